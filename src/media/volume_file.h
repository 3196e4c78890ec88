// SPDX-License-Identifier: Apache-2.0
// Mitsuba's grid volume files, *.vol.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/ray.h"

namespace covary {

struct VolumeFile {
  int size[3] = {0, 0, 0};  ///< cells along x, y, z
  int channels = 0;         ///< 1 or 3
  Bounds3 bounds;           ///< as stored in the file
  /// values[((z * size[1] + y) * size[0] + x) * channels + c]
  std::vector<float> values;
};

/// Throws Error(kIo) if the file cannot be read; Error(kInput) if it is not such a file, if its length does not match
/// its header, if it does not fit in memory, or if it holds values that are not finite.
VolumeFile read_volume_file(const std::string& path);

/// The same from memory; `where` names it in messages.
VolumeFile parse_volume(const std::string& where, std::string_view bytes);

}  // namespace covary
