// SPDX-License-Identifier: Apache-2.0
// Two lobes on the side of the normal: the reflection of a coating, and a diffuse base below it.
#pragma once

#include "bsdfs/roughness.h"
#include "core/warp.h"
#include "scene/bsdf.h"

namespace covary {

/// Parameters common to these models.
class CoatedBsdf : public Bsdf {
 public:
  const Texture* main_texture() const final { return diffuse_.texture(); }
  Spectrum albedo(const SurfaceHit& hit) const final { return clamp01(diffuse_.eval(hit)); }

 protected:
  /// `specular`: default of specular_reflectance.
  explicit CoatedBsdf(Parameters& p, float specular = 1)
      : diffuse_(p, "diffuse_reflectance", 0.5f), specular_(p, "specular_reflectance", specular) {
    const float sum = diffuse_.mean() + specular_.mean();
    specular_weight_ = sum > 0 ? specular_.mean() / sum : 0.5f;
  }
  /// The relative index of a rough coating must not be 1.
  static void check_index(float eta, Parameters& p) {
    if (eta == 1) p.error("'int_ior' and 'ext_ior' are equal; they must differ");
  }
  ColourInput diffuse_, specular_;
  float specular_weight_;
};

/// CRTP base of the closure of a model with a rough coating. `Model` provides eval() and specular_pmf(cosine of wo),
/// the probability of the coating's lobe.
template <typename Model>
class CoatedClosure : public BsdfClosure {
 public:
  explicit CoatedClosure(const RoughSurface& surface) : surface_(surface) {}

  uint32_t flags() const final { return kGlossyReflection | kDiffuseReflection; }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const final {
    BsdfSample s;  // single return object: copy elision (NRVO)
    if (!(wo.z > 0)) return s;
    if (u_lobe < model().specular_pmf(wo.z)) {
      s.wi = reflect(wo, surface_.sample(wo, u).m);
      s.flags = kGlossyReflection;
    } else {
      s.wi = warp::square_to_cosine_hemisphere(u);
      s.flags = kDiffuseReflection;
      s.lobe = 1;
    }
    const BsdfValue v = model().eval(wo, s.wi);
    if (!(v.pdf_solid_angle > 0)) return s;
    s.pdf = v.pdf_solid_angle;
    s.weight = v.value / s.pdf;
    return s;
  }
  int n_lobes() const final { return 2; }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const final {
    pmfs[0] = wo.z > 0 ? model().specular_pmf(wo.z) : 0;
    pmfs[1] = wo.z > 0 ? 1 - pmfs[0] : 0;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const final {
    pdfs[0] = pdfs[1] = 0;
    if (!(wo.z > 0 && wi.z > 0)) return;
    const Vec3 m = normalize(wo + wi);
    pdfs[0] = surface_.pdf(wo, m) / (4 * dot(wo, m));
    pdfs[1] = warp::cosine_hemisphere_pdf_solid_angle(wi.z);
  }

 protected:
  ~CoatedClosure() = default;
  RoughSurface surface_;

 private:
  const Model& model() const { return static_cast<const Model&>(*this); }
};

}  // namespace covary
