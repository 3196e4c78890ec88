// SPDX-License-Identifier: Apache-2.0
// The squared error of the written image, without a reference: Stein's unbiased risk estimate [Stein1981], which
// [Li2012] brought to rendering. With the mean h of independent samples, whose variance is v, and any image M made from
// them,
//
//     E (M - mu)^2 = E[ (M - h)^2 - v + 2 cov(M, h) ],
//
// including bias. The covariance, there from derivatives of the filter, is told by the estimator that made M
// (EstimatorResult::covariance), or comes from both halves of the samples: for an M that is locally linear in them,
//
//     cov(M, h) = E[ (M_A - M_B) (h_A - h_B) ] / 4,   and likewise   var M = E (M_A - M_B)^2 / 4.
//
// If both halves determined the weights, as in mixtures, each half depends on the other's samples, so that the
// covariance, and with it the estimate, is too small under strong noise. The noise of the estimate is mostly that of h,
// about sqrt(2) v per value, so it is only useful over many pixels. Further sums measure how noisy it is:
// error_interval.h derives an error and its interval from all of them.
#pragma once

#include <array>
#include <vector>

#include "estimators/method.h"
#include "filters/planes.h"

namespace covary {

struct ImageRiskInput {
  const Image* image = nullptr;                     ///< M
  std::array<const Image*, 2> halves = {};          ///< M_A, M_B; null where M is h itself
  const Moments* independent = nullptr;             ///< h and v
  std::array<const Moments*, 2> independents = {};  ///< h_A, h_B; null where M is h itself
  const GroupedImage* groups = nullptr;             ///< the groups whose mean is h
  const Image* guide = nullptr;                     ///< errors are relative to its brightness
  const std::vector<unsigned char>* valid = nullptr;
  Features surfaces = {};             ///< tell mirrors and glass, where the surfaces behind them are known, too
  const Image* covariance = nullptr;  ///< cov(M, h), if known; then no halves are needed
  const Image* std_error = nullptr;   ///< then, the root of var M
};

/// Sums over each row of the image. Rows are independent, so those of bands can be joined. Bit-identical for any number
/// of threads.
std::vector<RiskRow> image_risk(const ImageRiskInput& input);

/// Sets the rows and kind of `mean`, the mean of these groups with their standard error; does nothing if pixels have
/// one group.
void add_risk_of_mean(const GroupedImage& groups, MethodImage& mean);

/// Sums over all rows.
RiskRow sum_of(const std::vector<RiskRow>& rows);

}  // namespace covary
