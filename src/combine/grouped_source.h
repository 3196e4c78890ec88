// SPDX-License-Identifier: Apache-2.0
// Source of the rows of a grouped image: files, read on demand, or memory.
#pragma once

#include <functional>
#include <string>

#include "combine/grouped_file.h"
#include "combine/pair_input.h"
#include "film/film.h"
#include "film/grouped_image.h"

namespace covary {

struct GroupedSource {
  ImageOrigin origin;
  int width = 0, height = 0, groups = 0;
  /// Samples per pixel, on average; 0 if unknown.
  double samples = 0;
  /// Rows first … first + n - 1. The referenced memory is valid until the next call.
  std::function<GroupedImage(int first, int n)> rows;

  GroupedImage all() const { return rows(0, height); }
};

/// `file` must outlive the source.
GroupedSource source_of(const GroupedFile& file);
/// The memory that `image` refers to must outlive the source. An origin without a place: of the whole frame. Throws
/// Error(kUsage) for an empty image, and for a place of another size.
GroupedSource source_of(const GroupedImage& image, ImageOrigin origin);
/// A film of a render, which must outlive the source. `name`: for messages.
GroupedSource source_of(const Film& film, const std::string& name);

}  // namespace covary
