// SPDX-License-Identifier: Apache-2.0
// Media, phase functions and volumes by the names used in scene files. To add one: a line in registry.cpp, a file in
// CMake.
#pragma once

#include <span>

#include "scene/medium.h"
#include "scene/parameters.h"

namespace covary {

/// All plugins of a kind, sorted by name.
std::span<const Plugin<Medium>> medium_plugins();
std::span<const Plugin<PhaseFunction>> phase_plugins();
std::span<const Plugin<Volume>> volume_plugins();

/// The phase function of media that specify none.
PhasePtr isotropic_phase();

}  // namespace covary
