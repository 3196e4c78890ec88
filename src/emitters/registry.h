// SPDX-License-Identifier: Apache-2.0
// Emitters by the names used in scene files; each plugin's file documents its parameters. To add one: a line in
// registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/emitter.h"
#include "scene/parameters.h"

namespace covary {

/// All plugins of a kind, sorted by name.
std::span<const Plugin<Emitter>> emitter_plugins();

}  // namespace covary
