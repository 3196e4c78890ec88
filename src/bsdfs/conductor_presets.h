// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/spectrum.h"

namespace covary {

/// Measured complex index of refraction eta + i k of a conductor as linear RGB.
struct ConductorPreset {
  std::string_view name;
  Spectrum eta, k;
};

/// Null if there is no such name. Names are case sensitive, like chemical formulas.
const ConductorPreset* find_conductor_preset(std::string_view name);
/// All names, sorted.
std::vector<std::string> conductor_preset_names();

}  // namespace covary
