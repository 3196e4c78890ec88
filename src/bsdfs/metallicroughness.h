// SPDX-License-Identifier: Apache-2.0
// The parameters of `metallicroughness`, as the scene's file gives them and at a point.
#pragma once

#include "bsdfs/inputs.h"

namespace covary {

struct MetalRoughInputs {
  ColourInput base_color, specular_color, sheen_color, through_color;
  NumberInput metallic, roughness, specular, transmission, clearcoat, clearcoat_roughness, sheen_roughness, iridescence,
      thickness, through;
  TexturePtr anisotropy_map, clearcoat_normal, base_normal;  // may be null
};
struct MetalRoughPoint {
  Spectrum base, specular_color, sheen, through_color;
  float metallic, roughness, specular, transmission, clearcoat, clearcoat_roughness, sheen_roughness, iridescence,
      thickness, through;
  float anisotropy, cos_turn, sin_turn;  // of its direction
  Vec3 coat_normal{0, 0, 1};             // unit, in the frame of the base
};
struct MetalRoughSettings {
  float ior, iridescence_ior, anisotropy, anisotropy_rotation;
  bool thin, transmits, diffuses;
  uint32_t flags() const {
    return kDiffuseReflection | kGlossyReflection | (transmits ? uint32_t{kGlossyTransmission} : 0u) |
           (diffuses ? uint32_t{kDiffuseTransmission} : 0u);
  }
};

/// Whether no parameter is textured.
inline bool is_constant(const MetalRoughInputs& in) {
  for (const NumberInput* n :
       {&in.metallic, &in.roughness, &in.specular, &in.transmission, &in.clearcoat, &in.clearcoat_roughness,
        &in.sheen_roughness, &in.iridescence, &in.thickness, &in.through})
    if (!n->is_constant()) return false;
  for (const ColourInput* c : {&in.base_color, &in.specular_color, &in.sheen_color, &in.through_color})
    if (!c->is_constant()) return false;
  return !in.anisotropy_map && !in.clearcoat_normal;
}
/// The normal of a normal map in the frame along dp/du; `side` is -1 where the texture is mirrored.
inline Vec3 stored_normal(const Texture& map, const SurfaceHit& hit, float side) {
  const Spectrum c = map.eval(hit);
  const Vec3 n{2 * c.r - 1, side * (2 * c.g - 1), 2 * c.b - 1};
  return n.z > 0 ? normalize(n) : Vec3{0, 0, 1};
}
/// The parameters at a point.
inline MetalRoughPoint point_of(const MetalRoughInputs& in, const MetalRoughSettings& settings, const SurfaceHit& hit) {
  const auto number = [&](const NumberInput& n) { return clamp01(n.eval(hit)); };
  MetalRoughPoint p{clamp01(in.base_color.eval(hit)),
                    in.specular_color.eval(hit),
                    clamp01(in.sheen_color.eval(hit)),
                    clamp01(in.through_color.eval(hit)),
                    number(in.metallic),
                    number(in.roughness),
                    number(in.specular),
                    number(in.transmission),
                    number(in.clearcoat),
                    number(in.clearcoat_roughness),
                    number(in.sheen_roughness),
                    number(in.iridescence),
                    std::max(in.thickness.eval(hit), 0.0f),
                    number(in.through),
                    settings.anisotropy,
                    std::cos(settings.anisotropy_rotation),
                    std::sin(settings.anisotropy_rotation)};
  // Tangent space is left-handed where the texture is mirrored.
  const float side = dot(cross(hit.frame.n, hit.dp_du), hit.dp_dv) < 0 ? -1.0f : 1.0f;
  if (in.clearcoat_normal) {
    p.coat_normal = stored_normal(*in.clearcoat_normal, hit, side);
    if (in.base_normal)
      p.coat_normal = Frame::from_tangent(stored_normal(*in.base_normal, hit, side), {1, 0, 0}).to_local(p.coat_normal);
  }
  if (in.anisotropy_map) {
    const Spectrum stored = in.anisotropy_map->eval(hit);
    const float x = 2 * stored.r - 1, y = 2 * stored.g - 1, length = std::sqrt(x * x + y * y);
    p.anisotropy *= clamp01(stored.b);
    if (length > 0) {
      const float cosine = (p.cos_turn * x - p.sin_turn * y) / length;
      p.sin_turn = (p.sin_turn * x + p.cos_turn * y) / length, p.cos_turn = cosine;
    }
  }
  p.sin_turn *= side;
  return p;
}

}  // namespace covary
