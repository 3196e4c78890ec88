// SPDX-License-Identifier: Apache-2.0
#include "textures/registry.h"

namespace covary {

std::span<const Plugin<Texture>> texture_plugins() {
  static constexpr Plugin<Texture> kPlugins[] = {
      {"bitmap", make_bitmap},
      {"checkerboard", make_checkerboard},
      {"mesh_attribute", make_mesh_attribute},
      {"rawconstant", make_rawconstant},
      {"scale", make_scaled},
      {"uniform", make_uniform},
      {"vertexcolor", make_vertex_colour},
  };
  return kPlugins;
}

}  // namespace covary
