// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/registry.h"

namespace covary {

std::span<const Plugin<Bsdf>> bsdf_plugins() {
  static constexpr Plugin<Bsdf> kPlugins[] = {
      {"blendbsdf", make_blendbsdf},
      {"bumpmap", make_bumpmap},
      {"circular", make_circular},
      {"conductor", make_conductor},
      {"dielectric", make_dielectric},
      {"diffuse", make_diffuse},
      {"hair", make_hair},
      {"mask", make_mask},
      {"measured", make_measured},
      {"normalmap", make_normalmap},
      {"null", make_null},
      {"plastic", make_plastic},
      {"polarizer", make_polarizer},
      {"pplastic", make_pplastic},
      {"principled", make_principled},
      {"principledthin", make_principledthin},
      {"retarder", make_retarder},
      {"roughconductor", make_roughconductor},
      {"roughdielectric", make_roughdielectric},
      {"roughplastic", make_roughplastic},
      {"thindielectric", make_thindielectric},
      {"twosided", make_twosided},
  };
  return kPlugins;
}

}  // namespace covary
