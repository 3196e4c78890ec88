// SPDX-License-Identifier: Apache-2.0
// What the readers of pbrt's materials share.
#pragma once

#include "pbrt/pbrt_objects.h"

namespace covary {

/// pbrt's surfaces look the same from both sides.
ObjectBuilder two_sided(const ObjectBuilder& model);

/// Roughness (alpha) along u and v.
struct PbrtRoughness {
  Value u = 0.0, v = 0.0;
  bool smooth() const { return is_smooth(u) && is_smooth(v); }
  /// Sets the properties of a model with GGX microfacets.
  void set(ObjectDescription& model) const;
  /// pbrt treats smaller alphas as perfectly smooth.
  static bool is_smooth(const Value& alpha) {
    return std::holds_alternative<double>(alpha) && std::get<double>(alpha) < 1e-3;
  }
};
/// From the parameters `roughness`, `uroughness`, `vroughness` with this prefix; nullopt after an error.
std::optional<PbrtRoughness> pbrt_roughness(PbrtParameters& p, const std::string& prefix, PbrtNames& names,
                                            double fallback = 0);

/// glTF's parameter for a roughness alpha, whose square it is.
Value metallic_roughness(const Value& alpha, const SourceLocation& where);

/// Complex index of refraction; or a texture of the reflectance at normal incidence.
struct PbrtConductor {
  Value eta = 1.0, k = 1.0;
  ObjectPtr reflectance;
};
/// From `eta` and `k` with this prefix, or `reflectance`; that of copper by default. Nullopt after an error.
std::optional<PbrtConductor> pbrt_conductor(PbrtParameters& p, const std::string& prefix, PbrtNames& names);

// pbrt_layers.cpp; null after an error.
ObjectBuilder make_pbrt_coated_diffuse(PbrtParameters& p, PbrtNames& names);
ObjectBuilder make_pbrt_coated_conductor(PbrtParameters& p, PbrtNames& names);
ObjectBuilder make_pbrt_subsurface(PbrtParameters& p, PbrtNames& names);
/// Of version 3 (pbrt_version_3.cpp); nullopt for materials that version 4 has with the same parameters.
std::optional<ObjectBuilder> make_pbrt_material_3(const std::string& type, PbrtParameters& p, PbrtNames& names);

}  // namespace covary
