// SPDX-License-Identifier: Apache-2.0
// Media, phase functions and volumes by the names scene files use. A new one: a word in registry.cpp, a file in CMake.
#pragma once

#include <span>

#include "scene/medium.h"
#include "scene/parameters.h"

namespace covary {

/// All of a kind, sorted by name.
std::span<const Plugin<Medium>> medium_plugins();
std::span<const Plugin<PhaseFunction>> phase_plugins();
std::span<const Plugin<Volume>> volume_plugins();

/// What a medium has that names none.
PhasePtr isotropic_phase();

}  // namespace covary
