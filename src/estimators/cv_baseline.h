// SPDX-License-Identifier: Apache-2.0
// Image-space control variates that ignore the errors of the independent image: "CV (baseline)" of Yang & Moon 2025
// [YM2025], Sec. 3, Eq. (6). A comparator.
//
// Unequal group sizes and counts: control_variates.h; with no penalty, the counts of the independent image matter to
// the standard error alone. Every group of every pixel needs a sample.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

class Settings;
struct Estimator;

struct CvBaselineOptions {
  /// Number of control variates; default 25, 1 … number of pixels in the window ([YM2025] Sec. 5).
  int k = 25;
  /// Side of the square they are chosen from; default 11, odd, 3 … 63 ([YM2025] Sec. 4).
  int window = 11;
  /// Whether the target pixel is one of them. Default true, as in iicv.
  bool include_target = true;
  /// Default per channel: with shared coefficients and the target included, the least-squares solution is the target
  /// itself, that is the independent image.
  bool shared_coefficients = false;
  /// Ridge added to X^T X, relative to its mean diagonal; >= 0. 0, the default, is the solution of smallest norm, as
  /// X^T X is singular for k >= T. The paper states no ridge, but its published errors need one.
  float ridge = 0;
  /// Also estimate the standard error by Eq. (8); `independent` then needs 2 groups.
  bool std_error = false;
  PixelProbe* probe = nullptr;  ///< optional; inside the image

  std::vector<std::string> validate() const;
};

/// Throws Error(kUsage) that lists every problem. `crn` needs at least 3 groups.
EstimatorResult cv_baseline(const GroupedImage& crn, const GroupedImage& independent,
                            const CvBaselineOptions& options = {});

/// Memory that cv_baseline() takes beside its input, its result included: bytes per pixel, about.
inline constexpr double kCvBaselineBytesPerPixel = (2 * 6 + 6 + 3 + 6) * sizeof(float) + 1;

/// The estimator `cv-baseline` with these options. Throws Error(kUsage) that lists everything that is wrong with them.
Estimator make_cv_baseline(Settings& options);

}  // namespace covary
