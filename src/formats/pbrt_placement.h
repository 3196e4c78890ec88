// SPDX-License-Identifier: Apache-2.0
// The directives of pbrt's scene files that move what follows them.
#pragma once

#include <map>
#include <string>

#include "formats/pbrt_parameters.h"

namespace covary {

/// What shapes and lights are placed with.
struct PbrtPlacement {
  Transform to_world;
  bool reverse_orientation = false;
};
/// CoordinateSystem: transformations by name.
using PbrtSystems = std::map<std::string, Transform>;

/// Carries the directive `word` out, with the words that follow it; false where it is none of these.
bool change_placement(const std::string& word, PbrtTokens& tokens, const SourceLocation& where,
                      PbrtPlacement& placement, PbrtSystems& systems, Diagnostics& diagnostics);

}  // namespace covary
