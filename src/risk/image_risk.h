// SPDX-License-Identifier: Apache-2.0
// The squared error of the image that is written, without a reference (ours). With the mean h of independent samples,
// whose variance is v, and any image M that was made of them,
//
//     E (M - mu)^2 = E[ (M - h)^2 - v + 2 cov(M, h) ],
//
// bias included. The covariance comes from both halves of the samples: for an M that is locally linear in them,
//
//     cov(M, h) = E[ (M_A - M_B) (h_A - h_B) ] / 4,   and likewise   var M = E (M_A - M_B)^2 / 4.
//
// Weights that were chosen by both halves, as those of mixtures, let each half follow the other's samples, so that the
// covariance and with it the estimate come out too small where noise is strong. The noise of the estimate is that of h,
// mostly, about sqrt(2) v per value, so that an image has it over many pixels only. Beside it are sums that tell how
// noisy it is: error_interval.h makes an error and its interval of all of them.
#pragma once

#include <array>
#include <vector>

#include "estimators/estimator_result.h"
#include "filters/planes.h"

namespace covary {

struct ImageRiskInput {
  const Image* image = nullptr;                     ///< M
  std::array<const Image*, 2> halves = {};          ///< M_A, M_B; null where M is h itself
  const Moments* independent = nullptr;             ///< h and v
  std::array<const Moments*, 2> independents = {};  ///< h_A, h_B; null where M is h itself
  const GroupedImage* groups = nullptr;             ///< of which h is the mean
  const Image* guide = nullptr;                     ///< whose brightness errors are relative to
  const std::vector<unsigned char>* valid = nullptr;
};

/// Sums over every row of the image. Rows do not depend on each other, so that those of bands can be joined, and are
/// bit-identical for any number of threads.
std::vector<RiskRow> image_risk(const ImageRiskInput& input);

/// Sets the rows and kind of `mean`, which is that of these groups and has their standard error; nothing where pixels
/// have one group.
void add_risk_of_mean(const GroupedImage& groups, EstimatorResult& mean);

/// All rows together.
RiskRow sum_of(const std::vector<RiskRow>& rows);

}  // namespace covary
