// SPDX-License-Identifier: Apache-2.0
// The directives of pbrt scene files that transform what follows them.
#pragma once

#include <map>
#include <string>

#include "formats/pbrt_parameters.h"

namespace covary {

/// The placement of shapes and lights.
struct PbrtPlacement {
  Transform to_world;
  bool reverse_orientation = false;
};
/// CoordinateSystem: transformations by name.
using PbrtSystems = std::map<std::string, Transform>;

/// Executes the directive `word` with the words after it; false if it is not one of these.
bool change_placement(const std::string& word, PbrtTokens& tokens, const SourceLocation& where,
                      PbrtPlacement& placement, PbrtSystems& systems, Diagnostics& diagnostics);

}  // namespace covary
