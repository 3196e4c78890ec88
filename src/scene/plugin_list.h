// SPDX-License-Identifier: Apache-2.0
// A module's registry out of one list of names.
#pragma once

#include "scene/parameters.h"

#define COVARY_DECLARE_PLUGIN(Type, name) std::shared_ptr<Type> make_##name(Parameters& parameters);
#define COVARY_PLUGIN_ROW(Type, name) {#name, make_##name},

/// Defines `function`, which returns the plugins of a type, and declares make_NAME() of each, which its own file
/// defines, and which returns null after recording an error. LIST(PLUGIN, Type) has PLUGIN(Type, NAME) for each name
/// of scene files, sorted.
#define COVARY_PLUGINS(Type, function, LIST)                                    \
  LIST(COVARY_DECLARE_PLUGIN, Type)                                             \
  std::span<const Plugin<Type>> function() {                                    \
    static constexpr Plugin<Type> kPlugins[] = {LIST(COVARY_PLUGIN_ROW, Type)}; \
    return kPlugins;                                                            \
  }
