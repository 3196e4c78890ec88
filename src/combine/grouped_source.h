// SPDX-License-Identifier: Apache-2.0
// Where the rows of a grouped image come from: files, read as needed, or memory.
#pragma once

#include <functional>

#include "combine/grouped_file.h"
#include "combine/pair_input.h"
#include "film/grouped_image.h"

namespace covary {

struct GroupedSource {
  ImageOrigin origin;
  int width = 0, height = 0, groups = 0;
  /// Samples per pixel, on average; 0 if unknown.
  double samples = 0;
  /// Rows first … first + n - 1. What they point to is valid until the next call.
  std::function<GroupedImage(int first, int n)> rows;

  GroupedImage all() const { return rows(0, height); }
};

/// `file` must live as long as the source.
GroupedSource source_of(const GroupedFile& file);
/// What `image` points to must live as long as the source.
GroupedSource source_of(const GroupedImage& image, ImageOrigin origin);

}  // namespace covary
