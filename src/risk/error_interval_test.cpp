// SPDX-License-Identifier: Apache-2.0
#include "risk/error_interval.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "estimators/mean.h"
#include "risk/error_interval_table.h"
#include "risk/image_risk.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

/// Sums of an image of which much is known.
RiskRow known_sums() {
  RiskRow s;
  s.values = 30000, s.parts = 625, s.groups = 12;
  s.error = 90, s.squares = 16, s.variance = 45;
  s.noise = 900, s.noise_squares = 60;
  s.scaled_error = 2000, s.scaled_squares = 9000, s.scaled_variance = 1000;
  s.light = 120000, s.light_of_largest = 20000;
  s.predicted = 60;
  s.squared_deviations = 10, s.fourth_powers = 40;
  return s;
}

EstimatorResult result_of(const RiskRow& sums, ErrorKind kind) {
  EstimatorResult result;
  result.estimate = result.std_error = Image(4, 4, 3);
  std::fill(result.std_error.data.begin(), result.std_error.data.end(), 0.01f);
  result.risk_rows = {sums}, result.risk_kind = kind;
  return result;
}

TEST(ErrorInterval, IsAroundThePredictedError) {
  for (const ErrorKind kind : {ErrorKind::kFilters, ErrorKind::kNetwork}) {
    EstimatorResult result = result_of(known_sums(), kind);
    const double before = predicted_relmse(result);
    apply_interval(result);
    ASSERT_TRUE(result.interval);
    EXPECT_EQ(result.interval->unknown, "");
    EXPECT_TRUE(result.risk_rows.empty());
    const double middle = predicted_relmse(result);
    const PredictedBounds bounds = predicted_bounds(result, middle).value();
    EXPECT_LT(bounds.low, middle);
    EXPECT_GT(bounds.high, middle);
    RiskRow sums = known_sums();
    sums.predicted = before * sums.values;
    EXPECT_NEAR(middle / std::exp(fitted_error(sums, kind).middle), 1, 1e-5);
  }
}

/// log(relMSE) by the formulas of the page, step by step.
double middle_by_hand(const RiskRow& s, const ErrorFeatures& a) {
  const auto ratio = [](double sum, double squares, double parts, double whole) {
    const double scatter = std::sqrt(squares - sum * sum / parts) / sum, trust = 1 / (1 + 4 * scatter * scatter);
    return std::array{trust * std::log(sum / whole), 1 - trust};
  };
  const auto plain = ratio(s.error, s.squares, s.parts, s.variance);
  const auto scaled = ratio(s.scaled_error, s.scaled_squares, s.parts, s.scaled_variance);
  return std::log(s.variance / s.values) + a[0] + a[1] * plain[0] + a[2] * plain[1] + a[3] * scaled[0] +
         a[4] * std::log(s.noise / s.variance) + a[5] * std::log(s.noise / s.values) +
         a[6] * std::log(s.fourth_powers / s.squared_deviations) +
         a[7] * std::log(s.noise * s.noise / s.noise_squares) +
         a[8] * std::log(s.light_of_largest * s.groups / s.light) + a[9] * std::log(s.predicted / s.variance);
}

TEST(ErrorInterval, IsThatOfTheTable) {
  const RiskRow sums = known_sums();
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kFilters).middle, middle_by_hand(sums, kFittedErrors[0].middle), 1e-12);
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kNetwork).middle, middle_by_hand(sums, kFittedErrors[1].middle), 1e-12);
}

TEST(ErrorInterval, IsNotGivenWhereFewPixelsHoldTheNoise) {
  RiskRow sums = known_sums();
  sums.noise_squares = sums.noise * sums.noise / 4;
  EstimatorResult result = result_of(sums, ErrorKind::kNetwork);
  apply_interval(result);
  EXPECT_EQ(result.interval->unknown, "4 of 10000 pixels hold most of the noise");
}

TEST(ErrorInterval, IsNotGivenWhereLightIsMissing) {
  RiskRow sums = known_sums();
  sums.light_of_largest = 0.9 * sums.light;
  EstimatorResult result = result_of(sums, ErrorKind::kNetwork);
  apply_interval(result);
  EXPECT_EQ(result.interval->unknown, "90 % of the light are in one of 12 groups of each pixel");
  EXPECT_FALSE(predicted_bounds(result, predicted_relmse(result)));
  EXPECT_EQ(doubt_of_prediction(result, 64, 0),
            "no interval can be given: 90 % of the light are in one of 12 groups of each pixel");
}

TEST(ErrorInterval, IsNotGivenOfBlackImages) {
  EstimatorResult result = result_of({}, ErrorKind::kFilters);
  apply_interval(result);
  EXPECT_EQ(result.interval->unknown, "its samples do not differ");
}

TEST(ErrorInterval, IsNotReliableBeyondAFactorOfOneAndAHalf) {
  EstimatorResult result = result_of(known_sums(), ErrorKind::kFilters);
  result.interval = ErrorInterval{0.7, 1.49, ""};
  EXPECT_EQ(doubt_of_prediction(result, 64, 0), "");
  result.interval = ErrorInterval{0.7, 1.6, ""};
  EXPECT_EQ(doubt_of_prediction(result, 64, 0), "known to a factor of 1.6");
  result.interval = ErrorInterval{0.5, 1.2, ""};
  EXPECT_EQ(doubt_of_prediction(result, 64, 0), "known to a factor of 2");
}

TEST(ErrorInterval, HasFeaturesThatDoNotChangeWithBrightnessOrSize) {
  RiskRow large = known_sums();
  for (const auto& [name, sum] : kRiskSums)
    if (sum != &RiskRow::groups) large.*sum *= 4;  // as many rows again, three times
  const ErrorFeatures a = error_features(known_sums()), b = error_features(large);
  for (const size_t i : {0, 4, 5, 6, 8, 9}) EXPECT_NEAR(a[i], b[i], 1e-12) << i;
  EXPECT_LT(b[2], a[2]) << "more pixels hide less";
}

}  // namespace
}  // namespace covary
