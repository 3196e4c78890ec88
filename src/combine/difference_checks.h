// SPDX-License-Identifier: Apache-2.0
// Checks of renders that shall differ in their seed alone, by their differences: noise of one render is independent of
// its other pixels, and as often above that of another render as below it.
#pragma once

#include <vector>

#include "combine/input_checks.h"
#include "film/grouped_image.h"

namespace covary {

class DifferenceChecks {
 public:
  /// Of `groups` renders of this size; of large ones rows are left out.
  DifferenceChecks(int width, int height, int groups);
  /// The next rows.
  void add_rows(const GroupedImage& image);
  /// Appends an error for renders that were denoised before, that share random numbers, or of which one is brighter.
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
