// SPDX-License-Identifier: Apache-2.0
// diffuse: ideally diffuse (Lambertian) reflection on the side of the normal; black from the other side.
//
// | name        | type           | default | meaning                                  |
// |-------------|----------------|---------|------------------------------------------|
// | reflectance | colour/texture | 0.5     | fraction of light reflected, per channel |
//
// f = reflectance / pi. Cosine-weighted sampling: the sample weight is the reflectance itself.
#include "bsdfs/inputs.h"
#include "bsdfs/registry.h"
#include "core/warp.h"
#include "scene/lambertian.h"

namespace covary {
namespace {

class DiffuseClosure final : public BsdfClosure {
 public:
  explicit DiffuseClosure(const Spectrum& reflectance) : reflectance_(reflectance) {}

  uint32_t flags() const override { return kDiffuseReflection; }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    if (!(wo.z > 0 && wi.z > 0)) return {};
    const float pdf = warp::cosine_hemisphere_pdf_solid_angle(wi.z);
    return {reflectance_ * pdf, pdf};
  }
  BsdfSample sample(const Vec3& wo, float, Vec2 u) const override {
    BsdfSample s;  // single return object: copy elision (NRVO)
    if (!(wo.z > 0)) return s;
    s.wi = warp::square_to_cosine_hemisphere(u);
    s.pdf = warp::cosine_hemisphere_pdf_solid_angle(s.wi.z);
    if (s.pdf > 0) s.weight = reflectance_;
    s.flags = kDiffuseReflection;
    return s;
  }
  int n_lobes() const override { return 1; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override { pmfs[0] = wo.z > 0 ? 1 : 0; }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    pdfs[0] = wo.z > 0 ? warp::cosine_hemisphere_pdf_solid_angle(wi.z) : 0;
  }

 private:
  Spectrum reflectance_;
};

class Diffuse final : public Bsdf, public MaybeLambertian {
 public:
  explicit Diffuse(Parameters& p)
      : reflectance_(p, "reflectance", 0.5f),
        constant_(reflectance_.constant()),
        lambertian_{reflectance_.constant(), reflectance_.texture()} {}

  uint32_t flags() const override { return kDiffuseReflection; }
  const BsdfClosure* bind(const SurfaceHit& hit, bool, TransportMode, Arena& arena) const override {
    if (reflectance_.is_constant()) return &constant_;
    return arena.make<DiffuseClosure>(reflectance_.eval(hit));
  }
  const Lambertian* lambertian() const override { return &lambertian_; }
  const Texture* main_texture() const override { return reflectance_.texture(); }
  Spectrum albedo(const SurfaceHit& hit) const override { return clamp01(reflectance_.eval(hit)); }

 private:
  ColourInput reflectance_;
  DiffuseClosure constant_;
  Lambertian lambertian_;
};

}  // namespace

std::shared_ptr<Bsdf> make_diffuse(Parameters& parameters) { return std::make_shared<Diffuse>(parameters); }

}  // namespace covary
