// SPDX-License-Identifier: Apache-2.0
// null: an index-matched surface; light passes straight through. No parameters.
#include "bsdfs/registry.h"

namespace covary {
namespace {

class NullClosure final : public BsdfClosure {
 public:
  uint32_t flags() const override { return kNullTransmission; }
  BsdfValue eval(const Vec3&, const Vec3&) const override { return {}; }
  BsdfSample sample(const Vec3& wo, float, Vec2) const override {
    return {.wi = -wo, .weight = Spectrum(1), .pdf = 1, .eta = 1, .flags = kNullTransmission};
  }
  NullPassage null_passage(const Vec3&) const override { return {Spectrum(1), 1}; }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3&, float* pmfs) const override { pmfs[0] = 1; }
  void lobe_pdfs(const Vec3&, const Vec3&, float* pdfs) const override { pdfs[0] = 0; }
};

class Null final : public Bsdf {
 public:
  uint32_t flags() const override { return kNullTransmission; }
  const BsdfClosure* bind(const SurfaceHit&, bool, TransportMode, Arena&) const override { return &closure_; }
  Spectrum albedo(const SurfaceHit&) const override { return Spectrum(1); }

 private:
  NullClosure closure_;
};

}  // namespace

std::shared_ptr<Bsdf> make_null(Parameters&) { return std::make_shared<Null>(); }

}  // namespace covary
