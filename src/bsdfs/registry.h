// SPDX-License-Identifier: Apache-2.0
// The reflectance models by the name scene files use. A new model: a word in registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/bsdf.h"
#include "scene/parameters.h"

namespace covary {

/// All of a kind, sorted by name.
std::span<const Plugin<Bsdf>> bsdf_plugins();

}  // namespace covary
