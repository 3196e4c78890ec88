// SPDX-License-Identifier: Apache-2.0
// Roughness parameters of the rough models, and the choice between sampling visible or all normals.
//
// | name             | type           | default  | meaning                                                            |
// |------------------|----------------|----------|--------------------------------------------------------------------|
// | distribution     | string         | beckmann | distribution of microfacet normals: beckmann or ggx                |
// | alpha            | number/texture | 0.1      | roughness (for beckmann the RMS slope of the microfacets)          |
// | alpha_u, alpha_v | number/texture |          | instead of alpha: roughness along and across the tangent dp/du     |
// | sample_visible   | bool           | true     | sample only normals visible from wo; false: all of them, noisier   |
#pragma once

#include "bsdfs/inputs.h"
#include "bsdfs/microfacet.h"
#include "core/warp.h"

namespace covary {

/// A microfacet distribution and how its normals are sampled.
struct RoughSurface {
  Microfacet normals;
  bool sample_visible;

  /// Samples a normal for w (`w.z` > 0), continuous in u, with its density per unit solid angle.
  Microfacet::Sample sample(const Vec3& w, Vec2 u) const {
    return sample_visible ? normals.sample(w, u) : sample_all(u);
  }
  /// Density of sample().
  float pdf(const Vec3& w, const Vec3& m) const {
    return sample_visible ? normals.pdf(w, m) : normals.eval(m) * std::max(m.z, 0.0f);
  }
  /// f_cos / (F pdf(m)) for the normal m that sample() drew: everything but the Fresnel term and the Jacobian, which is
  /// common to value and density.
  float weight(const Vec3& wo, const Vec3& wi, const Vec3& m) const {
    if (sample_visible) return normals.smith_g1(wi, m);
    return normals.smith_g(wo, wi, m) * std::abs(dot(wo, m) / (wo.z * m.z));
  }
  /// The same surface, `factor` times as rough.
  RoughSurface scaled(float factor) const {
    return {Microfacet(normals.type(), normals.alpha_u() * factor, normals.alpha_v() * factor), sample_visible};
  }

 private:
  /// [Walter2007] Eqs. (28) and (35): density D(m) cos(theta_m).
  Microfacet::Sample sample_all(Vec2 u) const {
    const Vec2 d = warp::square_to_disk(u);
    const float r2 = std::min(dot(d, d), kOneMinusEpsilon);  // uniform in [0, 1)
    if (r2 == 0) return {{0, 0, 1}, normals.eval({0, 0, 1})};
    const float slope2 = normals.type() == MicrofacetType::kGgx ? r2 / (1 - r2) : -std::log1p(-r2);
    const float scale = std::sqrt(slope2 / r2);
    const Vec3 m = normalize({normals.alpha_u() * d.x * scale, normals.alpha_v() * d.y * scale, 1});
    return {m, normals.eval(m) * m.z};
  }
};

struct RoughnessInput {
  MicrofacetType type;
  NumberInput alpha_u, alpha_v;
  bool sample_visible, anisotropic;

  RoughSurface eval(const SurfaceHit& hit) const {
    const float au = alpha_u.eval(hit);
    return {Microfacet(type, au, anisotropic ? alpha_v.eval(hit) : au), sample_visible};
  }
};

/// Reads the parameters above.
RoughnessInput get_roughness(Parameters& parameters);

}  // namespace covary
