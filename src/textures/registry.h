// SPDX-License-Identifier: Apache-2.0
// Textures by the names used in scene files; each plugin's file documents its parameters. To add one: a line in
// registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/parameters.h"
#include "scene/texture.h"

namespace covary {

/// All plugins of a kind, sorted by name.
std::span<const Plugin<Texture>> texture_plugins();

}  // namespace covary
