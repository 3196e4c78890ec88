// SPDX-License-Identifier: Apache-2.0
// Errors of an image F against a reference R, and the split of the error of many renders into squared bias and
// variance. N pixels, 3 channels c; R' is the mean of a pixel's three reference values. With two independent references
// R1, R2 of equal quality, R is their mean, and where a formula is quadratic in F - R the product (F - R1)(F - R2)
// takes the place of the square, so that the references' own noise cancels on average [the value can then be negative].
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "film/film.h"

namespace covary {

enum class Metric { kRelMse, kMse, kMae, kMape, kFlip };

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

struct MetricResult {
  double value = 0;           ///< mean over the finite pixels
  uint64_t n_pixels = 0;      ///< finite pixels
  uint64_t n_non_finite = 0;  ///< pixels with a value that is not finite in F, R1 or R2; left out
  Image map;  ///< 1 channel: the error of each pixel, whose mean is `value`; not-a-number where left out
};

/// Images of equal size with 3 channels, linear RGB. `references`: one or two. For FLIP, `low_dynamic_range` chooses
/// LDR-FLIP (values are clamped to [0, 1]) over HDR-FLIP. Throws Error(kInput) when the sizes differ or no pixel is
/// left.
MetricResult compute_metric(Metric metric, const Image& image, std::span<const Image> references,
                            bool low_dynamic_range = false);

/// Error of K independent renders of one scene, divided into variance and squared bias. All are relative as relMSE is:
/// means over pixels and channels of x / (R'^2 + 0.01). Memory does not depend on K.
class ErrorSplit {
 public:
  /// With two independent references the squared bias is free of their noise; with one it contains the noise's square.
  explicit ErrorSplit(std::vector<Image> references);
  /// Adds a render with a seed of its own. Pixels that are not finite in any render or reference are left out.
  void add(const Image& image);

  struct Result {
    uint64_t n_renders = 0, n_pixels = 0, n_non_finite = 0;
    double rel_mse = 0;           ///< mean over the renders
    double rel_mse_error = 0;     ///< standard error of that mean
    double variance = 0;          ///< of one render; unbiased
    double squared_bias = 0;      ///< unbiased, so it can be negative: rel_mse - variance
    double mean_ratio = 0;        ///< mean of all renders over mean of the references
    double mean_ratio_error = 0;  ///< its standard error over the renders
  };
  /// Throws Error(kInput) with fewer than two renders.
  Result result() const;

 private:
  std::vector<Image> references_;
  uint64_t n_renders_ = 0;
  std::vector<double> sum_, sum_squares_;  // of F - R per pixel and channel
  std::vector<char> finite_;               // per pixel
  std::vector<double> rel_mse_, means_;    // of each render
};

}  // namespace covary
