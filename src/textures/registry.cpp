// SPDX-License-Identifier: Apache-2.0
#include "textures/registry.h"

#include "scene/plugin_list.h"

namespace covary {

// clang-format off
#define COVARY_TEXTURES(PLUGIN, T) \
  PLUGIN(T, bilerp) PLUGIN(T, bitmap) PLUGIN(T, checkerboard) PLUGIN(T, dots) PLUGIN(T, mesh_attribute) \
  PLUGIN(T, mix) PLUGIN(T, noise) PLUGIN(T, projected) PLUGIN(T, rawconstant) PLUGIN(T, scale) PLUGIN(T, uniform) \
  PLUGIN(T, vertexcolor)
// clang-format on

COVARY_PLUGINS(Texture, texture_plugins, COVARY_TEXTURES)

}  // namespace covary
