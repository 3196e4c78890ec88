// SPDX-License-Identifier: Apache-2.0
// The emitters by the name scene files use; each plugin's file documents its parameters. A new emitter: a word in
// registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/emitter.h"
#include "scene/parameters.h"

namespace covary {

/// All of a kind, sorted by name.
std::span<const Plugin<Emitter>> emitter_plugins();

}  // namespace covary
