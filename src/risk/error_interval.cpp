// SPDX-License-Identifier: Apache-2.0
#include "risk/error_interval.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "risk/error_interval_table.h"
#include "risk/image_risk.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

/// Relative scatter at which what the samples tell counts as much as what is usual.
constexpr double kTrusted = 0.5;
/// No error is taken to be less than this part of the variance, or more than so many times as much.
constexpr double kLeastOverVariance = 0.25, kMostOverVariance = 4;

/// How large a ratio is, and how much that is hidden by its noise.
struct Ratio {
  double log = 0, hidden = 1;
};

/// Of sums over parts: sum / whole, both of the same weight; `squares`: of the sums of the parts.
Ratio ratio_of(double sum, double squares, double parts, double whole) {
  const double least = std::max(sum, kLeastOverVariance * whole);
  const double scatter = std::sqrt(std::max(0.0, squares - sum * sum / std::max(parts, 1.0))) / least;
  const double trust = 1 / (1 + scatter * scatter / (kTrusted * kTrusted));
  return {trust * std::log(std::min(least / whole, kMostOverVariance)), 1 - trust};
}

double dot(const ErrorFeatures& a, const ErrorFeatures& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Multiplies standard errors so that their squares are `factor` times as large.
void scale(Image& std_error, double factor) {
  for (float& value : std_error.data) value *= static_cast<float>(std::sqrt(factor));
}

const FittedErrors& fit_of(ErrorKind kind) { return kFittedErrors[kind == ErrorKind::kNetwork]; }

}  // namespace

ErrorFeatures error_features(const RiskRow& s) {
  const Ratio plain = ratio_of(s.error, s.squares, s.parts, s.variance);
  const Ratio scaled = ratio_of(s.scaled_error, s.scaled_squares, s.parts, s.scaled_variance);
  const double kurtosis = s.squared_deviations > 0 ? s.fourth_powers / s.squared_deviations : 1;
  return {1,
          plain.log,
          plain.hidden,
          scaled.log,
          std::log(s.noise / s.variance),
          std::log(s.noise / s.values),
          std::log(kurtosis),
          std::log(s.noise * s.noise / s.noise_squares),
          std::log(std::max(s.light_of_largest, 1e-30) * s.groups / std::max(s.light, 1e-30)),
          std::log(s.predicted / s.variance)};
}

LogError fitted_error(const RiskRow& sums, ErrorKind kind) {
  const FittedErrors& fit = fit_of(kind);
  const ErrorFeatures x = error_features(sums);
  LogError error;
  error.middle = std::log(sums.variance / sums.values) + dot(fit.middle, x);
  const double spread = std::exp(std::clamp(dot(fit.log_spread, x), fit.least_log_spread, fit.most_log_spread));
  error.low = error.middle + fit.low * spread, error.high = error.middle + fit.high * spread;
  return error;
}

std::string unknown_error(const RiskRow& sums, const LogError& error) {
  const double n = sums.noise * sums.noise / sums.noise_squares, pixels = sums.values / 3;
  if (n < std::max(kFewestPixels, kFewestOfPixels * pixels))
    return fmt::format("{:.0f} of {:.0f} pixels hold most of the noise", std::max(1.0, n), pixels);
  const double share = sums.light > 0 ? sums.light_of_largest / sums.light : 1;
  if (share > kMostOfLargest)
    return fmt::format("{:.0f} % of the light are in one of {:.0f} groups of each pixel", 100 * share, sums.groups);
  if (std::max(error.high - error.middle, error.middle - error.low) > std::log(kMostFactor))
    return "few samples hold most of the light";
  return "";
}

void apply_interval(EstimatorResult& result) {
  if (result.risk_rows.empty()) return;
  RiskRow sums = sum_of(result.risk_rows);
  result.risk_rows.clear();
  const double predicted = predicted_relmse(result);
  sums.predicted = predicted * sums.values;
  result.risk_sums = sums;
  if (!(predicted > 0 && sums.variance > 0 && sums.noise > 0 && std::isfinite(sums.error + sums.noise_squares))) {
    result.interval = ErrorInterval{1, 1, "its samples do not differ"};
    return;
  }
  const LogError error = fitted_error(sums, result.risk_kind);
  scale(result.std_error, std::exp(error.middle) / predicted);
  result.interval = ErrorInterval{std::exp(error.low - error.middle), std::exp(error.high - error.middle),
                                  unknown_error(sums, error)};
}

}  // namespace covary
