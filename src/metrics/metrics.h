// SPDX-License-Identifier: Apache-2.0
// Errors of an image F against a reference R. N pixels, 3 channels c; R' is the mean of a pixel's three reference
// values. With two independent references R1, R2 of equal quality, R is their mean, and where a formula is quadratic in
// F - R the product (F - R1)(F - R2) takes the place of the square, so that the references' own noise cancels on
// average [the value can then be negative].
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
/// Relative error of a pixel that kAbove5 counts, as perceptible [Csonka2002] Sec. 6.
inline constexpr double kPerceptible = 0.05;

/// Part of the values, the largest ones, that kRelMseTrimmed leaves out [Hua2023] Sec. 7.
inline constexpr double kTrimmedPart = 0.001;

enum class Metric { kRelMse, kRelMseTrimmed, kMse, kMae, kMape, kFlip, kAbove5 };

struct MetricInfo {
  Metric metric;
  std::string name;         ///< as on the command line
  std::string formula;      ///< with one reference
  std::string formula_two;  ///< with two references
};
/// All metrics, in the order of the enumeration.
const std::vector<MetricInfo>& metrics();
/// Throws Error(kUsage) that names the nearest metric.
const MetricInfo& find_metric(const std::string& name);

/// Whether pixel p (in rows, from 0) of an image of 3 channels has finite values only.
bool pixel_is_finite(const Image& image, size_t p);

struct MetricResult {
  double value = 0;           ///< mean over the finite pixels
  uint64_t n_pixels = 0;      ///< finite pixels
  uint64_t n_non_finite = 0;  ///< pixels with a value that is not finite in F, R1 or R2; left out
  /// 1 channel: the error of each pixel, whose mean is `value`; not-a-number where left out. What kRelMseTrimmed leaves
  /// out is 0 here.
  Image map;
  double mean = 0, reference_mean = 0;  ///< of all values of the finite pixels
};

/// Images of equal size with 3 channels, linear RGB. `references`: one or two. For FLIP, `low_dynamic_range` chooses
/// LDR-FLIP (values are clamped to [0, 1]) over HDR-FLIP. Throws Error(kInput) when the sizes differ or no pixel is
/// left.
MetricResult compute_metric(Metric metric, const Image& image, std::span<const Image> references,
                            bool low_dynamic_range = false);
/// The same of images that need not fit in memory: bit by bit what whole images give. Some metrics read them more than
/// once. Without `with_map`, there is no map.
MetricResult compute_metric(Metric metric, ComparedRows& rows, bool low_dynamic_range, bool with_map);

}  // namespace covary
