// SPDX-License-Identifier: Apache-2.0
// Directives of pbrt scene files that transform the objects after them.
#pragma once

#include <map>
#include <string>

#include "core/transform.h"
#include "pbrt_text/pbrt_tokens.h"

namespace covary {

/// Transformation and orientation of shapes and lights.
struct PbrtPlacement {
  Transform to_world;
  bool reverse_orientation = false;
  bool at_start = true, at_end = true;  ///< ActiveTransform: for which times transformations apply
  bool flat = false;                    ///< a singular transformation flattens what is placed, which is left out
};
/// CoordinateSystem: transformations by name.
using PbrtSystems = std::map<std::string, Transform>;

/// Executes the directive `word` with its arguments; false if it is not a transformation. What moves stays where it is
/// at the start, with a warning.
bool change_placement(const std::string& word, PbrtTokens& tokens, const SourceLocation& where,
                      PbrtPlacement& placement, PbrtSystems& systems, PbrtMessages& messages);

}  // namespace covary
