// SPDX-License-Identifier: Apache-2.0
// Finds groups that were rendered with the same seed, in renderers that are not exact to the bit, too: their noise is
// the same, so that they differ far less than neighbouring pixels do.
#pragma once

#include <vector>

#include "combine/input_checks.h"
#include "film/grouped_image.h"

namespace covary {

class SameSeedChecks {
 public:
  /// For `groups` groups of this size; of large images, some rows are skipped.
  SameSeedChecks(int width, int height, int groups);
  /// The next rows.
  void add_rows(const GroupedImage& image);
  /// Appends an error if two groups have the same noise. Where neighbouring pixels hardly differ
  /// (black, constant or noise-free parts), equal groups are no evidence.
  void report(const ImageNames& names, std::vector<Finding>& findings) const;

 private:
  int step_, next_row_ = 0;
  struct Group {
    /// D = a - b - c + d for squares of 2 x 2 pixels with the grey values a, b; c, d; 0 if it is less than 1 % of the
    /// brightest.
    std::vector<float> details;
    long varied = 0;  ///< squares whose D is not exactly 0
    double sum = 0;   ///< of grey values
  };
  std::vector<Group> groups_;
};

}  // namespace covary
