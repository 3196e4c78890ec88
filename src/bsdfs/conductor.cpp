// SPDX-License-Identifier: Apache-2.0
// conductor: a perfectly smooth metal; mirror reflection on the side of the normal, black from the other side.
//
// | name                 | type           | default | meaning                                                        |
// |----------------------|----------------|---------|----------------------------------------------------------------|
// | material             | string         | none    | a measured metal (conductor_presets.cpp), or none: full mirror |
// | eta, k               | colour/texture | 0, 1    | complex index of refraction eta + i k, instead of `material`   |
// | specular_reflectance | colour/texture | 1       | factor on the reflection; not physical unless 1                |
#include "bsdfs/fresnel.h"
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"

namespace covary {
namespace {

class ConductorClosure final : public BsdfClosure {
 public:
  ConductorClosure(const Spectrum& eta, const Spectrum& k, const Spectrum& scale) : eta_(eta), k_(k), scale_(scale) {}

  uint32_t flags() const override { return kDeltaReflection; }
  BsdfValue eval(const Vec3&, const Vec3&) const override { return {}; }
  BsdfSample sample(const Vec3& wo, float, Vec2) const override {
    if (!(wo.z > 0)) return {};
    return {.wi = reflect(wo),
            .weight = scale_ * fresnel_conductor(wo.z, eta_, k_),
            .pdf = 1,
            .eta = 1,
            .flags = kDeltaReflection};
  }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { pmfs[0] = wo.z > 0 ? 1 : 0; }
  void lobe_pdfs(const Vec3&, const Vec3&, float* pdfs) const override { pdfs[0] = 0; }

 private:
  Spectrum eta_, k_, scale_;
};

class Conductor final : public Bsdf {
 public:
  explicit Conductor(Parameters& p) : index_(get_conductor(p)), scale_(p, "specular_reflectance", 1) {}

  uint32_t flags() const override { return kDeltaReflection; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<ConductorClosure>(index_.eta.eval(hit), index_.k.eval(hit), scale_.eval(hit));
  }
  /// Reflectance at normal incidence.
  Spectrum albedo(const SurfaceHit& hit) const override {
    return clamp01(scale_.eval(hit) * fresnel_conductor(1, index_.eta.eval(hit), index_.k.eval(hit)));
  }

 private:
  ConductorInput index_;
  ColourInput scale_;
};

}  // namespace

std::shared_ptr<Bsdf> make_conductor(Parameters& parameters) { return std::make_shared<Conductor>(parameters); }

}  // namespace covary
