// SPDX-License-Identifier: Apache-2.0
// The emitters by the name scene files use; each plugin's file documents its parameters. A new emitter: one line here,
// one in registry.cpp, one in CMake.
#pragma once

#include <memory>
#include <span>

#include "scene/emitter.h"
#include "scene/parameters.h"

namespace covary {

/// All emitters, sorted by name.
std::span<const Plugin<Emitter>> emitter_plugins();

// Each returns null after recording an error.
std::shared_ptr<Emitter> make_area(Parameters& parameters);
std::shared_ptr<Emitter> make_constant(Parameters& parameters);
std::shared_ptr<Emitter> make_directional(Parameters& parameters);
std::shared_ptr<Emitter> make_envmap(Parameters& parameters);
std::shared_ptr<Emitter> make_point(Parameters& parameters);
std::shared_ptr<Emitter> make_projector(Parameters& parameters);
std::shared_ptr<Emitter> make_spot(Parameters& parameters);
std::shared_ptr<Emitter> make_sunsky(Parameters& parameters);

}  // namespace covary
