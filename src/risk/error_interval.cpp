// SPDX-License-Identifier: Apache-2.0
#include "risk/error_interval.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "risk/error_interval_table.h"
#include "risk/image_risk.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

/// Relative scatter at which the samples' estimate and the typical value have equal weight.
constexpr double kTrusted = 0.5;
/// Bounds of the error as multiples of the variance.
constexpr double kMinOverVariance = 0.5, kMaxOverVariance = 30;
/// Fraction of the covariance that halves miss (docs/notes/error-estimates.md).
constexpr double kMissingCovariance = 0.27;

/// The logarithm of a ratio, and how much of it noise hides.
struct Ratio {
  double log = 0, hidden = 1;
};

/// R, but at least kMinOverVariance V.
double risk_of(const RiskRow& s) {
  return std::max(s.error + kMissingCovariance * s.covariance, kMinOverVariance * s.variance);
}

/// log(R / V), shrunk by noise.
Ratio ratio_of(const RiskRow& s) {
  const double least = risk_of(s);
  const double scatter = std::sqrt(std::max(0.0, s.squares - s.error * s.error / std::max(s.parts, 1.0))) / least;
  const double trust = 1 / (1 + scatter * scatter / (kTrusted * kTrusted));
  return {trust * std::log(std::min(least / s.variance, kMaxOverVariance)), 1 - trust};
}

double dot(const ErrorFeatures& a, const ErrorFeatures& b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0);
}

/// Multiplies standard errors so that their squares are `factor` times as large.
void scale(Image& std_error, double factor) {
  for (float& value : std_error.data) value *= static_cast<float>(std::sqrt(factor));
}

/// The first image is the mean, or that of an estimator, whose error its own standard error tells.
void scale_candidates(MeasuredRisks& risks, double factor, double variance_over_error) {
  for (size_t i = 1; i < risks.images.size(); ++i) risks.images[i].relmse *= factor;
  risks.bias_share = std::clamp(1 - variance_over_error, 0.0, 1.0);
}

/// Whether images of this kind with few groups have a separate fit.
bool fitted_to_few(ErrorKind kind) { return kind == ErrorKind::kFilters || kind == ErrorKind::kNetwork; }

bool is_mixture(ErrorKind kind, double groups) {
  return kind != ErrorKind::kMean && kind != ErrorKind::kPair && kind != ErrorKind::kPairHalves && groups >= kMinGroups;
}

/// Fraction of log(relMSE / V) explained by an image's features: less, the closer a mixture is to the mean.
double not_the_mean(const RiskRow& sums, ErrorKind kind) {
  if (!is_mixture(kind, sums.groups)) return 1;
  return 1 - std::min(1.0, sums.variance / sums.noise);
}

const FittedErrors& fit_of(ErrorKind kind, double groups) {
  if (groups < kMinGroups && fitted_to_few(kind)) return kFittedToFew[kind == ErrorKind::kNetwork];
  return kFittedErrors[static_cast<size_t>(kind)];
}

/// Whether few pixels hold most of the noise.
bool hold_most_noise(const RiskRow& sums) { return sums.noise * sums.noise < kMinPixels * sums.noise_squares; }

double share_of_largest(const RiskRow& sums) { return sums.light > 0 ? sums.light_of_largest / sums.light : 1; }

}  // namespace

ErrorFeatures error_features(const RiskRow& s) {
  const Ratio ratio = ratio_of(s);
  const double kurtosis = s.squared_deviations > 0 ? s.fourth_powers / s.squared_deviations : 1;
  return {1,
          ratio.log,
          ratio.hidden,
          std::log(s.noise / s.variance),
          std::log(s.noise / s.values),
          std::log(kurtosis),
          std::log(s.noise * s.noise / s.noise_squares),
          std::log(std::max(s.light_of_largest, 1e-30) * s.groups / std::max(s.light, 1e-30)),
          std::log(s.predicted / s.variance)};
}

LogError fitted_error(const RiskRow& sums, ErrorKind kind) {
  const FittedErrors& fit = fit_of(kind, sums.groups);
  const ErrorFeatures x = error_features(sums);
  LogError error;
  const double part = not_the_mean(sums, kind);
  error.middle = std::log(sums.variance / sums.values) + part * dot(fit.middle, x);
  const double spread = std::exp(std::clamp(dot(fit.log_spread, x), fit.min_log_spread, fit.max_log_spread));
  error.low = error.middle + fit.low * spread, error.high = error.middle + fit.high * spread;
  if (is_mixture(kind, sums.groups)) {  // R sees light that the mixture left out; of few groups it is too noisy
    const double risk = std::log(sums.variance / sums.values) + part * std::log(risk_of(sums) / sums.variance);
    error.high = std::max(error.high, std::min(risk, error.middle + std::log(kMaxFactor)));
  }
  return error;
}

bool has_rare_light(const RiskRow& sums) {
  const double share = share_of_largest(sums);
  return (share - 1 / sums.groups) / (1 - 1 / sums.groups) > kMaxOfLargest;  // 0 if all groups hold equal shares
}

std::string unknown_error(const RiskRow& sums, ErrorKind kind, const LogError& error) {
  if (sums.groups < kMinGroups && !fitted_to_few(kind))
    return fmt::format("{:.0f} groups of samples are too few; {} are needed", sums.groups, kMinGroups);
  const double n = sums.noise * sums.noise / sums.noise_squares, pixels = sums.values / 3;
  if (hold_most_noise(sums))
    return fmt::format("{:.0f} of {:.0f} pixels hold most of the noise", std::max(1.0, n), pixels);
  if (has_rare_light(sums))
    return fmt::format("{:.0f} % of the light is in one of {:.0f} groups of each pixel", 100 * share_of_largest(sums),
                       sums.groups);
  if (not_the_mean(sums, kind) * sums.specular_noise > kMaxSpecular * sums.noise)  // of what the mixture removes
    return fmt::format("{:.0f} % of the noise is in mirrors or behind glass", 100 * sums.specular_noise / sums.noise);
  if (std::max(error.high - error.middle, error.middle - error.low) > std::log(kMaxFactor))
    return "few samples hold most of the light";
  return "";
}

namespace {

/// The fireflies, and their light in other pixels, if they alone would make the error far larger than predicted: then
/// nothing is known.
void take_fireflies(EstimatorResult& result) {
  const RiskRow& sums = *result.risk_sums;
  const Fireflies fireflies = fireflies_in(result);
  const double spread = hold_most_noise(sums) ? sums.spread / sums.values : 0;
  const double own = predicted_relmse(result), hidden = std::max(fireflies.relmse, spread);
  if (!(hidden > kMaxFactor * own * result.interval->middle)) return;
  std::string unknown = result.interval->unknown;
  if (unknown.empty() || fireflies.relmse > spread)
    unknown = fmt::format(
        "{} pixels are more than {:.0f} times as bright as those around, by few samples: they may be fireflies",
        fireflies.pixels, kFireflyFactor);
  result.interval = ErrorInterval{hidden / own, 1, 1, unknown};
  result.risks.reset();  // they are relative to the fireflies, too
}

}  // namespace

EstimatorResult with_error(MethodImage image) {
  EstimatorResult& result = image;
  if (image.risk_rows.empty()) return std::move(result);
  RiskRow sums = sum_of(image.risk_rows);
  const double predicted = predicted_relmse(result);
  sums.predicted = predicted * sums.values;
  result.risk_sums = sums;
  if (!(predicted > 0 && sums.variance > 0 && sums.noise > 0 && std::isfinite(sums.error + sums.noise_squares))) {
    result.interval = ErrorInterval{1, 1, 1, "its samples do not differ"};
    return std::move(result);
  }
  const LogError error = fitted_error(sums, image.risk_kind);
  const double middle = std::exp(error.middle) / predicted;
  const bool scaled = image.risk_kind != ErrorKind::kMean;
  if (scaled) scale(result.std_error, middle);
  if (result.risks) scale_candidates(*result.risks, middle, sums.variance / (sums.values * std::exp(error.middle)));
  result.interval = ErrorInterval{scaled ? 1 : middle, std::exp(error.low - error.middle),
                                  std::exp(error.high - error.middle), unknown_error(sums, image.risk_kind, error)};
  take_fireflies(result);
  return std::move(result);
}

}  // namespace covary
