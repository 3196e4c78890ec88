// SPDX-License-Identifier: Apache-2.0
// Checks that two grouped images, from any renderer, meet the assumptions of image-space control variates: finite
// linear values; pixels of the independent image independent of each other and of the CRN image; pixels of the CRN
// image that share their random numbers; groups that are independent renders of one scene.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "film/grouped_image.h"
#include "film/written_by.h"

namespace covary {

struct Finding {
  enum class Severity { kNote, kWarning, kError };
  Severity severity;
  /// What is wrong and, for errors, which setting of the renderer to change.
  std::string text;
};

/// Mean rank correlation over the groups of pairs of pixels, and the standard error it would have for independent
/// pairs.
struct Correlation {
  double value = 0, standard_error = 0;
  long pairs = 0;  ///< 0: not measured (fewer than 3 groups, or no noise)
};

/// What messages call an image and the renders that it consists of.
struct ImageNames {
  std::string image = "independent image";
  std::vector<std::string> renders;        ///< files, one for each group; empty: groups of one file
  Renderer renderer = Renderer::kUnknown;  ///< that made them
  std::string render(size_t group) const;
  /// "3 renders", "12 groups"
  std::string count(size_t n) const;
  std::string how_to(RenderSetting setting) const { return where_to_set(setting, renderer); }
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

/// Measures the images and reports problems. Checks the values of every pixel, and at most about 250 000 pairs for each
/// correlation. Images may be given in bands of rows, from top to bottom; pairs across bands are skipped.
class InputChecks {
 public:
  /// Groups may have unequal sizes: rank correlations ignore sizes; means of groups are weighted by their samples. The
  /// images may have different numbers of groups; with fewer than 3, correlations cannot be measured, which gives a
  /// warning. `crn_groups` 0: there is no CRN image, and pixels of the independent image may depend on each other, but
  /// its groups may not.
  InputChecks(int width, int height, int crn_groups, int independent_groups);
  ~InputChecks();
  /// The next rows of both images. Throws Error(kUsage) if sizes differ or there are no rows.
  void add_rows(const GroupedImage& crn, const GroupedImage& independent);
  /// Call after the last row.
  InputReport report(const ImageNames& crn = {"CRN image", {}}, const ImageNames& independent = {}) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace covary
