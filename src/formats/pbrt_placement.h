// SPDX-License-Identifier: Apache-2.0
// Directives of pbrt scene files that transform the objects after them.
#pragma once

#include <map>
#include <string>

#include "formats/pbrt_parameters.h"

namespace covary {

/// Transformation and orientation of shapes and lights.
struct PbrtPlacement {
  Transform to_world;
  bool reverse_orientation = false;
};
/// CoordinateSystem: transformations by name.
using PbrtSystems = std::map<std::string, Transform>;

/// Executes the directive `word` with its arguments; false if it is not a transformation.
bool change_placement(const std::string& word, PbrtTokens& tokens, const SourceLocation& where,
                      PbrtPlacement& placement, PbrtSystems& systems, Diagnostics& diagnostics);

}  // namespace covary
