// SPDX-License-Identifier: Apache-2.0
// Defines a module's registry from one list of names.
#pragma once

#include "scene/parameters.h"

#define COVARY_DECLARE_PLUGIN(Type, name) std::shared_ptr<Type> make_##name(Parameters& parameters);
#define COVARY_PLUGIN_ROW(Type, name) {#name, make_##name},

/// Defines `function`, which returns the plugins of a type, and declares make_NAME() for each, which the plugin's own
/// file defines and which returns null after recording an error. LIST(PLUGIN, Type) expands to PLUGIN(Type, NAME) for
/// each name used in scene files, sorted.
#define COVARY_PLUGINS(Type, function, LIST)                                    \
  LIST(COVARY_DECLARE_PLUGIN, Type)                                             \
  std::span<const Plugin<Type>> function() {                                    \
    static constexpr Plugin<Type> kPlugins[] = {LIST(COVARY_PLUGIN_ROW, Type)}; \
    return kPlugins;                                                            \
  }
