// SPDX-License-Identifier: Apache-2.0
// difftrans: an ideally diffuse thin sheet, the same from both sides. Mitsuba 0.x has its transmission, pbrt-v4 both,
// as `diffusetransmission`.
//
// | name          | type           | default | meaning                                                    |
// |---------------|----------------|---------|------------------------------------------------------------|
// | transmittance | colour/texture | 0.5     | fraction of light transmitted, per channel                 |
// | reflectance   | colour/texture | 0       | fraction of light reflected; the sum is not checked        |
//
// f = reflectance / pi on the side of wo, transmittance / pi on the other. A side is chosen in proportion to the mean
// of its colour.
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"
#include "core/warp.h"

namespace covary {
namespace {

class DiffTransClosure final : public BsdfClosure {
 public:
  DiffTransClosure(const Spectrum& reflectance, const Spectrum& transmittance)
      : reflectance_(reflectance), transmittance_(transmittance) {
    const float r = mean(reflectance), t = mean(transmittance);
    reflected_ = r + t > 0 ? r / (r + t) : 0.5f;
  }

  uint32_t flags() const override { return kDiffuseReflection | kDiffuseTransmission; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (wo.z == 0 || wi.z == 0) return {};
    const float pdf = warp::cosine_hemisphere_pdf_solid_angle(std::abs(wi.z));
    const bool same_side = wo.z * wi.z > 0;
    return {(same_side ? reflectance_ : transmittance_) * pdf, (same_side ? reflected_ : 1 - reflected_) * pdf};
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    BsdfSample s;  // single return object: copy elision (NRVO)
    if (wo.z == 0) return s;
    const bool reflect = u_lobe < reflected_;
    s.wi = warp::square_to_cosine_hemisphere(u);
    if (reflect != (wo.z > 0)) s.wi.z = -s.wi.z;
    s.flags = reflect ? kDiffuseReflection : kDiffuseTransmission;
    s.lobe = reflect ? 0 : 1;
    const float pmf = reflect ? reflected_ : 1 - reflected_;
    s.pdf = pmf * warp::cosine_hemisphere_pdf_solid_angle(std::abs(s.wi.z));
    if (s.pdf > 0) s.weight = (reflect ? reflectance_ : transmittance_) / pmf;
    return s;
  }
  int n_lobes() const override { return 2; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    pmfs[0] = wo.z != 0 ? reflected_ : 0;
    pmfs[1] = wo.z != 0 ? 1 - reflected_ : 0;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    const float pdf = warp::cosine_hemisphere_pdf_solid_angle(std::abs(wi.z));
    pdfs[0] = wo.z * wi.z > 0 ? pdf : 0;
    pdfs[1] = wo.z * wi.z < 0 ? pdf : 0;
  }

 private:
  Spectrum reflectance_, transmittance_;
  float reflected_;
};

class DiffTrans final : public Bsdf {
 public:
  explicit DiffTrans(Parameters& p) : reflectance_(p, "reflectance", 0), transmittance_(p, "transmittance", 0.5f) {}

  uint32_t flags() const override { return kDiffuseReflection | kDiffuseTransmission; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    return arena.make<DiffTransClosure>(reflectance_.eval(hit), transmittance_.eval(hit));
  }
  const Texture* main_texture() const override {
    return reflectance_.texture() ? reflectance_.texture() : transmittance_.texture();
  }
  Spectrum albedo(const SurfaceHit& hit) const override {
    return clamp01(reflectance_.eval(hit) + transmittance_.eval(hit));
  }

 private:
  ColourInput reflectance_, transmittance_;
};

}  // namespace

std::shared_ptr<Bsdf> make_difftrans(Parameters& parameters) { return std::make_shared<DiffTrans>(parameters); }

}  // namespace covary
