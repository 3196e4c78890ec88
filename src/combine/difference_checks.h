// SPDX-License-Identifier: Apache-2.0
// Checks renders that should differ only in their seed, by their differences: the noise of a render is independent
// between pixels, and as often positive as negative relative to another render.
#pragma once

#include <vector>

#include "combine/input_checks.h"
#include "film/grouped_image.h"

namespace covary {

class DifferenceChecks {
 public:
  /// For `groups` renders of this size; of large ones, some rows are skipped.
  DifferenceChecks(int width, int height, int groups);
  /// The next rows.
  void add_rows(const GroupedImage& image);
  /// Appends an error if renders were already denoised, share random numbers, or one is brighter, and a warning if
  /// their pixel filter is wider than a pixel.
  void report(const ImageNames& names, std::vector<Finding>& findings) const;

 private:
  struct Pair {  ///< a render and the next
    long differ = 0, brighter = 0;
    struct Signs {  ///< of pairs of pixels
      long n = 0, same = 0;
    };
    Signs far, next;  ///< kDistance apart, and side by side
    double excess_brighter() const;
    double correlation(const Signs& signs) const;
  };
  void warn_of_filter(const ImageNames& names, std::vector<Finding>& findings) const;
  std::vector<Pair> pairs_;
  int step_;
};

}  // namespace covary
