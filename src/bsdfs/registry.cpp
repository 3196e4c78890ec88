// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/registry.h"

namespace covary {

std::span<const Plugin<Bsdf>> bsdf_plugins() {
  static constexpr Plugin<Bsdf> kPlugins[] = {
      {"conductor", make_conductor},
      {"dielectric", make_dielectric},
      {"diffuse", make_diffuse},
      {"mask", make_mask},
      {"null", make_null},
      {"plastic", make_plastic},
      {"thindielectric", make_thindielectric},
      {"twosided", make_twosided},
  };
  return kPlugins;
}

}  // namespace covary
