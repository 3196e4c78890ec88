// SPDX-License-Identifier: Apache-2.0
#include "media/registry.h"

namespace covary {

std::span<const Plugin<Medium>> medium_plugins() {
  static constexpr Plugin<Medium> kPlugins[] = {
      {"heterogeneous", make_heterogeneous},
      {"homogeneous", make_homogeneous},
  };
  return kPlugins;
}

std::span<const Plugin<PhaseFunction>> phase_plugins() {
  static constexpr Plugin<PhaseFunction> kPlugins[] = {
      {"hg", make_hg},
      {"isotropic", make_isotropic},
      {"rayleigh", make_rayleigh},
  };
  return kPlugins;
}

std::span<const Plugin<Volume>> volume_plugins() {
  static constexpr Plugin<Volume> kPlugins[] = {
      {"constvolume", make_constvolume},
      {"gridvolume", make_gridvolume},
  };
  return kPlugins;
}

}  // namespace covary
