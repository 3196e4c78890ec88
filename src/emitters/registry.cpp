// SPDX-License-Identifier: Apache-2.0
#include "emitters/registry.h"

namespace covary {

std::span<const Plugin<Emitter>> emitter_plugins() {
  static constexpr Plugin<Emitter> kPlugins[] = {
      {"area", make_area},     {"constant", make_constant}, {"directional", make_directional},
      {"envmap", make_envmap}, {"point", make_point},       {"projector", make_projector},
      {"spot", make_spot},     {"sunsky", make_sunsky},
  };
  return kPlugins;
}

}  // namespace covary
