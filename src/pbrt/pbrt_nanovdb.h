// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/transform.h"

namespace covary {

/// A grid of NanoVDB as one without gaps.
struct DenseGrid {
  int size[3] = {0, 0, 0};
  std::vector<float> values;  ///< x fastest
  Transform box;              ///< from the unit cube
  int step = 1;               ///< in voxels, between its values
};

/// Whether the program was built with NanoVDB's headers.
bool has_nanovdb();
/// The grid `name` of floats in a NanoVDB file; nullopt if it has none of this name. At most about 100 million values:
/// larger grids are sampled in steps. Where `box` is given, the grid is sampled at its points. Throws Error(kInput) if
/// the file cannot be read, or is damaged.
std::optional<DenseGrid> read_nanovdb(const std::string& path, const std::string& name,
                                      const DenseGrid* like = nullptr);

}  // namespace covary
