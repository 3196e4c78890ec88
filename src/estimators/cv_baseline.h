// SPDX-License-Identifier: Apache-2.0
// Image-space control variates that ignore the errors of the independent image: "CV (baseline)" of Yang & Moon 2025
// [YM2025], Sec. 3, Eq. (6). For comparison.
//
// Unequal group sizes and counts: see control_variates.h; without a penalty, the counts of the independent image affect
// only the standard error. Every group of every pixel needs a sample.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

class Settings;
struct Method;

struct CvBaselineOptions {
  /// Number of control variates; default 25, 1 … number of pixels in the window ([YM2025] Sec. 5).
  int k = 25;
  /// Side of the square window they are chosen from; default 11, odd, 3 … 63 ([YM2025] Sec. 4).
  int window = 11;
  /// Default per channel: with shared coefficients and the target included, the least-squares solution is the target
  /// itself, so that the result is the independent image.
  bool shared_coefficients = false;
  /// Ridge added to X^T X, relative to its mean diagonal; >= 0. Default 0: the minimum-norm solution, since X^T X is
  /// singular for k >= T. The paper states no ridge, but its published errors need one.
  float ridge = 0;
  /// Also estimate the standard error by Eq. (8), which needs 2 groups in `independent`.
  bool std_error = false;
  PixelProbe* probe = nullptr;  ///< optional; inside the image
};

/// Throws Error(kUsage) listing every problem with the inputs, or if k does not fit the window. `crn` needs at least 3
/// groups.
EstimatorResult cv_baseline(const GroupedImage& crn, const GroupedImage& independent,
                            const CvBaselineOptions& options = {});

/// Approximate memory of cv_baseline() beyond its input, including its result: bytes per pixel.
inline constexpr double kCvBaselineBytesPerPixel = (2 * 6 + 6 + 3 + 6) * sizeof(float) + 1;

inline constexpr const char* kCvBaseline = "cv-baseline";
/// The estimator `cv-baseline` with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_cv_baseline(Settings& options);

}  // namespace covary
