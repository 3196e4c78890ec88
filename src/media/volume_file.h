// SPDX-License-Identifier: Apache-2.0
// Mitsuba's files of values on a grid, *.vol.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/ray.h"

namespace covary {

struct VolumeFile {
  int size[3] = {0, 0, 0};  ///< cells along x, y, z
  int channels = 0;         ///< 1 or 3
  Bounds3 bounds;           ///< as the file says
  /// values[((z * size[1] + y) * size[0] + x) * channels + c]
  std::vector<float> values;
};

/// Throws Error(kIo) where the file cannot be read, Error(kInput) where it is none of these files, has another length
/// than its header says, needs more memory than there is, or holds values that are not finite.
VolumeFile read_volume_file(const std::string& path);

}  // namespace covary
