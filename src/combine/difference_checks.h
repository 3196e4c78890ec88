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
  /// Appends an error if renders were already denoised, share random numbers, or one is brighter.
  void report(const ImageNames& names, std::vector<Finding>& findings) const;

 private:
  struct Pair {  ///< a render and the next
    long differ = 0, brighter = 0;
    long n = 0, same_sign = 0;  ///< of pixels kDistance apart
    double excess_brighter() const;
    double correlation() const;
  };
  std::vector<Pair> pairs_;
  int step_;
};

}  // namespace covary
