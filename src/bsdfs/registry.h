// SPDX-License-Identifier: Apache-2.0
// Reflectance models by the names used in scene files. To add one: a line in registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/bsdf.h"
#include "scene/parameters.h"

namespace covary {

/// All plugins of a kind, sorted by name.
std::span<const Plugin<Bsdf>> bsdf_plugins();

}  // namespace covary
