// SPDX-License-Identifier: Apache-2.0
// Errors of an image F against a reference R. N pixels, 3 channels c; R' is the mean of a pixel's three reference
// values. Given two independent references R1, R2 of equal quality, R is their mean, and wherever a formula is
// quadratic in F - R, the product (F - R1)(F - R2) replaces the square, so that the references' noise cancels in
// expectation [the value can then be negative].
//
// It does not cancel if the same noise is in the denominator of a relative error: where both references happen to be
// dark, both differences have the same sign, and the error counts most. So with two references, relMSE is relative to
// other images D, the *denominators*: 1 / (R'^2 + 0.01) becomes the mean over them of 1 / (D'^2 + 0.01). Denoised
// references are such images (denoising/denoised_references.h): each of the two weights then has the noise of only one
// of the factors. A third image with little noise is another.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"
#include "metrics/compared_rows.h"

namespace covary {

/// Keeps relative errors finite at black pixels.
inline constexpr double kRelativeOffset = 0.01;
/// Relative error of a pixel above which kAbove5 counts it as perceptible [Csonka2002] Sec. 6.
inline constexpr double kPerceptible = 0.05;

/// Fraction of values, the largest, that kRelMseTrimmed drops [Hua2023] Sec. 7.
inline constexpr double kTrimmedPart = 0.001;

/// Standard error by the references' noise, as a fraction of an error, above which references need more samples.
inline constexpr double kMaxReferenceNoise = 0.1;

enum class Metric { kRelMse, kRelMseTrimmed, kMse, kMae, kMape, kFlip, kAbove5 };

struct MetricInfo {
  Metric metric;
  std::string name;         ///< as on the command line
  std::string formula;      ///< with one reference
  std::string formula_two;  ///< with two references
};
/// All metrics, in the order of the enumeration.
const std::vector<MetricInfo>& metrics();
/// Throws Error(kUsage) suggesting the nearest name.
const MetricInfo& find_metric(const std::string& name);

/// The weight of a pixel's squared error in relMSE: the mean over `denominators` of 1 / (D'^2 + 0.01), D': mean of the
/// pixel's three values; without them, D is the mean of the `references`. p: row-major index.
double relative_weight(std::span<const Image> references, std::span<const Image> denominators, size_t p);

/// Whether all values of pixel p (row-major index) of a 3-channel image are finite.
bool pixel_is_finite(const Image& image, size_t p);

struct MetricResult {
  double value = 0;           ///< mean over the finite pixels
  uint64_t n_pixels = 0;      ///< finite pixels
  uint64_t n_non_finite = 0;  ///< pixels left out because F, R1, R2 or D has a value that is not finite
  /// 1 channel: per-pixel errors, whose mean is `value`; NaN for pixels left out. Values that kRelMseTrimmed drops are
  /// 0.
  Image map;
  double mean = 0, reference_mean = 0;  ///< of F and R over all values of the finite pixels
  /// Standard error of `value` by the noise of two references, for kRelMse and kMse; otherwise 0. Noise of different
  /// pixels is taken as independent.
  double reference_error = 0;
};

/// Images of equal size with 3 channels, linear RGB. `references`: one or two. For FLIP, `low_dynamic_range` selects
/// LDR-FLIP (values clamped to [0, 1]) instead of HDR-FLIP. `denominators`: what kRelMse and kRelMseTrimmed are
/// relative to; none: the mean of the references, which makes errors against two noisy references too large. Throws
/// Error(kInput) if the sizes differ or no pixel is finite.
MetricResult compute_metric(Metric metric, const Image& image, std::span<const Image> references,
                            bool low_dynamic_range = false, std::span<const Image> denominators = {});
/// The same for images that need not fit in memory, with identical bits, and with the denominators of `rows`. Some
/// metrics read the images more than once. No map unless `with_map`.
MetricResult compute_metric(Metric metric, ComparedRows& rows, bool low_dynamic_range, bool with_map);

}  // namespace covary
