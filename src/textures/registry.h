// SPDX-License-Identifier: Apache-2.0
// The textures by the name scene files use; each plugin's file documents its parameters. A new texture: a word in
// registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/parameters.h"
#include "scene/texture.h"

namespace covary {

/// All of a kind, sorted by name.
std::span<const Plugin<Texture>> texture_plugins();

}  // namespace covary
