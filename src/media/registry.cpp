// SPDX-License-Identifier: Apache-2.0
#include "media/registry.h"

#include "scene/plugin_list.h"

namespace covary {

// clang-format off
#define COVARY_MEDIA(PLUGIN, T) \
  PLUGIN(T, heterogeneous) PLUGIN(T, homogeneous)
#define COVARY_PHASE_FUNCTIONS(PLUGIN, T) \
  PLUGIN(T, hg) PLUGIN(T, isotropic) PLUGIN(T, rayleigh)
#define COVARY_VOLUMES(PLUGIN, T) \
  PLUGIN(T, constvolume) PLUGIN(T, gridvolume)
// clang-format on

COVARY_PLUGINS(Medium, medium_plugins, COVARY_MEDIA)
COVARY_PLUGINS(PhaseFunction, phase_plugins, COVARY_PHASE_FUNCTIONS)
COVARY_PLUGINS(Volume, volume_plugins, COVARY_VOLUMES)

}  // namespace covary
