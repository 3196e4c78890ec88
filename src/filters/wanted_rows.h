// SPDX-License-Identifier: Apache-2.0
// Which rows a filter makes, of an image that is part of a larger one.
#pragma once

#include <limits>

namespace covary {

struct WantedRows {
  int first_row = 0;  ///< of the larger image: that with which the image begins
  /// The rows of the image that are made; all others of the result are unspecified.
  int first = 0, end = std::numeric_limits<int>::max();

  /// Whether any of the rows begin … end_of - 1 are wanted.
  bool any(int begin, int end_of) const { return begin < end && end_of > first; }
};

}  // namespace covary
