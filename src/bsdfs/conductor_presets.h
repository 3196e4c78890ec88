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

/// Null when there is no such name. Names are case sensitive, as chemical formulas are.
const ConductorPreset* find_conductor_preset(std::string_view name);
/// All names, sorted.
std::vector<std::string> conductor_preset_names();

}  // namespace covary
