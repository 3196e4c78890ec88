// SPDX-License-Identifier: Apache-2.0
#include "emitters/registry.h"

#include "scene/plugin_list.h"

namespace covary {

// clang-format off
#define COVARY_EMITTERS(PLUGIN, T) \
  PLUGIN(T, area) PLUGIN(T, constant) PLUGIN(T, directional) PLUGIN(T, environments) PLUGIN(T, envmap) \
  PLUGIN(T, goniometric) PLUGIN(T, point) PLUGIN(T, projector) PLUGIN(T, spot) PLUGIN(T, sunsky)
// clang-format on

COVARY_PLUGINS(Emitter, emitter_plugins, COVARY_EMITTERS)

}  // namespace covary
