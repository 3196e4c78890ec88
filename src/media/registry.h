// SPDX-License-Identifier: Apache-2.0
// Media, phase functions and volumes by the names scene files use. A new one: a line here, in registry.cpp, in CMake.
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

// Each returns null after recording an error.
std::shared_ptr<Medium> make_heterogeneous(Parameters& parameters);
std::shared_ptr<Medium> make_homogeneous(Parameters& parameters);
std::shared_ptr<PhaseFunction> make_hg(Parameters& parameters);
std::shared_ptr<PhaseFunction> make_isotropic(Parameters& parameters);
std::shared_ptr<PhaseFunction> make_rayleigh(Parameters& parameters);
std::shared_ptr<Volume> make_constvolume(Parameters& parameters);
std::shared_ptr<Volume> make_gridvolume(Parameters& parameters);

}  // namespace covary
