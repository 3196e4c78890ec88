// SPDX-License-Identifier: Apache-2.0
// Checks two grouped images, from any renderer, for what the image-space control variates assume of them: finite linear
// values; pixels of the independent image independent of each other and of the CRN image; pixels of the CRN image
// really sharing their random numbers; groups that are independent renders of one scene.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "film/grouped_image.h"

namespace covary {

struct Finding {
  enum class Severity { kNote, kWarning, kError };
  Severity severity;
  /// What is wrong and, for errors, the setting to change in the renderer that made the image.
  std::string text;
};

/// Mean rank correlation over the groups of pairs of pixels, with its standard error, were the pairs independent.
struct Correlation {
  double value = 0, standard_error = 0;
  long pairs = 0;  ///< 0: not measured (fewer than 3 groups, or no noise)
};

struct InputReport {
  Correlation crn_horizontal, crn_vertical;                  ///< neighbours of the CRN image
  Correlation independent_horizontal, independent_vertical;  ///< neighbours of the independent image
  Correlation crn_independent;                               ///< the same pixel in both
  double crn_mean = 0, independent_mean = 0;                 ///< grey image means
  double mean_difference_sigmas = 0;  ///< difference of the image means in standard errors, from the groups
  long nonfinite_pixels = 0, negative_pixels = 0, clipped_pixels = 0;
  std::vector<Finding> findings;
  bool has_errors() const;
};

/// Measures the images and says what is wrong. Looks at every pixel for its values and at no more than about 250 000
/// pairs for each correlation. Images can be given in bands of rows, from top to bottom; pairs across bands are left
/// out.
class InputChecks {
 public:
  /// Groups of unequal sizes: ranks of values do not look at sizes, means of groups are weighted by their samples. The
  /// images need not have the same number of groups; with fewer than 3, correlations cannot be measured, which is a
  /// warning. `crn_groups` 0: there is no CRN image, and pixels of the other need not be independent of each other,
  /// only its groups.
  InputChecks(int width, int height, int crn_groups, int independent_groups);
  ~InputChecks();
  /// The next rows of both images. Throws Error(kUsage) where sizes differ or there is nothing.
  void add_rows(const GroupedImage& crn, const GroupedImage& independent);
  /// After the last row.
  InputReport report() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace covary
