// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/registry.h"

#include "scene/plugin_list.h"

namespace covary {

// clang-format off
#define COVARY_BSDFS(PLUGIN, T) \
  PLUGIN(T, blendbsdf) PLUGIN(T, bumpmap) PLUGIN(T, circular) PLUGIN(T, coating) PLUGIN(T, conductor) \
  PLUGIN(T, dielectric) PLUGIN(T, difftrans) PLUGIN(T, diffuse) PLUGIN(T, hair) PLUGIN(T, mask) PLUGIN(T, measured) \
  PLUGIN(T, metallicroughness) PLUGIN(T, normalmap) PLUGIN(T, null) PLUGIN(T, phong) PLUGIN(T, plastic) \
  PLUGIN(T, polarizer) PLUGIN(T, pplastic) PLUGIN(T, principled) PLUGIN(T, principledthin) PLUGIN(T, retarder) \
  PLUGIN(T, roughcoating) PLUGIN(T, roughconductor) PLUGIN(T, roughdielectric) PLUGIN(T, roughplastic) \
  PLUGIN(T, thindielectric) PLUGIN(T, twosided) PLUGIN(T, ward)
// clang-format on

COVARY_PLUGINS(Bsdf, bsdf_plugins, COVARY_BSDFS)

}  // namespace covary
