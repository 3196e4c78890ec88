// SPDX-License-Identifier: Apache-2.0
// What a render is asked for in words and numbers, by the command line or from Python, as a RenderRequest has it.
#pragma once

#include <optional>
#include <string>

#include "plans/render.h"

namespace covary {

/// "box", "tent" or "gaussian", with the radius that the scene format has by default. Throws Error(kUsage).
FilterSettings filter_named(const std::string& name);

/// "both", "camera" or "light". Throws Error(kUsage).
CrnPart crn_part_named(const std::string& name);

/// "independent" or "sobol". Throws Error(kUsage).
Sampler sampler_named(const std::string& name);

/// Takes the samples of the integrator's training, where it has one, off those of the passes, where their number is
/// known. Throws Error(kUsage) where none are left.
void take_training(const LoadedScene& scene, RenderRequest& request);

}  // namespace covary
