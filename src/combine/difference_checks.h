// SPDX-License-Identifier: Apache-2.0
// Checks renders that should only differ in their seed, by their differences: the noise of a render is independent of
// its other pixels, and as often above another render as below it.
#pragma once

#include <vector>

#include "combine/input_checks.h"
#include "film/grouped_image.h"

namespace covary {

class DifferenceChecks {
 public:
  /// For `groups` renders of this size; of large ones some rows are left out.
  DifferenceChecks(int width, int height, int groups);
  /// The next rows.
  void add_rows(const GroupedImage& image);
  /// Appends an error if renders were denoised before, share random numbers, or one is brighter.
  void report(std::vector<Finding>& findings) const;

 private:
  struct Pair {  ///< of a render and the next
    long differ = 0, brighter = 0;
    long n = 0, same_sign = 0;  ///< of pixels kDistance apart
    double excess_brighter() const;
    double correlation() const;
  };
  std::vector<Pair> pairs_;
  int step_;
};

}  // namespace covary
