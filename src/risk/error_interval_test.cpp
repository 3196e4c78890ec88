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

/// Sums of an image about which much is known.
RiskRow known_sums() {
  RiskRow s;
  s.values = 30000, s.parts = 625, s.groups = 12;
  s.error = 90, s.squares = 16, s.covariance = 180, s.variance = 45;
  s.noise = 900, s.noise_squares = 60;
  s.light = 120000, s.light_of_largest = 20000;
  s.predicted = 60;
  s.squared_deviations = 10, s.fourth_powers = 40;
  return s;
}

MethodImage image_of(const RiskRow& sums, ErrorKind kind) {
  MethodImage result;
  result.estimate = result.std_error = Image(4, 4, 3);
  std::fill(result.std_error.data.begin(), result.std_error.data.end(), 0.01f);
  result.risk_rows = {sums}, result.risk_kind = kind;
  return result;
}

TEST(ErrorInterval, IsAroundThePredictedError) {
  for (const ErrorKind kind :
       {ErrorKind::kPair, ErrorKind::kFilters, ErrorKind::kNetwork, ErrorKind::kPairFilters, ErrorKind::kPairNetwork}) {
    const double before = predicted_relmse(image_of(known_sums(), kind));
    const EstimatorResult result = with_error(image_of(known_sums(), kind));
    ASSERT_TRUE(result.interval);
    EXPECT_EQ(result.interval->unknown, "");
    const double middle = predicted_relmse(result);
    const PredictedBounds bounds = predicted_error(result, 64, 0)->bounds.value();
    EXPECT_LT(bounds.low, middle);
    EXPECT_GT(bounds.high, middle);
    RiskRow sums = known_sums();
    sums.predicted = before * sums.values;
    EXPECT_NEAR(middle / std::exp(fitted_error(sums, kind).middle), 1, 1e-5);
  }
}

/// Candidates are known relative to the mixture: what is said of the mixture is said of them, too, so that their order
/// does not depend on the fit. The mean's error is its own.
TEST(ErrorInterval, ScalesTheErrorsOfCandidatesLikeThatOfTheirMixture) {
  MethodImage image = image_of(known_sums(), ErrorKind::kNetwork);
  const double before = predicted_relmse(image);
  image.risks = MeasuredRisks{before, 0.5, {{"mean", 0.03}, {"oidn", 1.2 * before}, {"sharp", 0.9 * before}}};
  const EstimatorResult result = with_error(image);
  const double middle = predicted_relmse(result);
  EXPECT_GT(std::abs(middle / before - 1), 0.05) << "the fit changes it";
  EXPECT_EQ(result.risks->images[0].relmse, 0.03);
  EXPECT_NEAR(result.risks->images[1].relmse / middle, 1.2, 1e-5);
  EXPECT_NEAR(result.risks->images[2].relmse / middle, 0.9, 1e-5);
  EXPECT_NEAR(result.risks->bias_share, std::max(0.0, 1 - known_sums().variance / known_sums().values / middle), 1e-5);
}

/// log(relMSE) by the documented formulas, step by step.
double middle_by_hand(const RiskRow& s, const ErrorFeatures& a, double part = 1) {
  const double risk = s.error + 0.27 * s.covariance;
  const double scatter = std::sqrt(s.squares - s.error * s.error / s.parts) / risk,
               trust = 1 / (1 + 4 * scatter * scatter);
  return std::log(s.variance / s.values) +
         part * (a[0] + a[1] * trust * std::log(risk / s.variance) + a[2] * (1 - trust) +
                 a[3] * std::log(s.noise / s.variance) + a[4] * std::log(s.noise / s.values) +
                 a[5] * std::log(s.fourth_powers / s.squared_deviations) +
                 a[6] * std::log(s.noise * s.noise / s.noise_squares) +
                 a[7] * std::log(s.light_of_largest * s.groups / s.light) + a[8] * std::log(s.predicted / s.variance));
}

TEST(ErrorInterval, OfAMeanLeavesItsStandardErrorAsItIs) {
  const MethodImage image = image_of(known_sums(), ErrorKind::kMean);
  const std::vector<float> before = image.std_error.data;
  const double predicted = predicted_relmse(image);
  const EstimatorResult result = with_error(image);
  EXPECT_EQ(result.std_error.data, before);
  const PredictedError error = predicted_error(result, 64, 0).value();
  RiskRow sums = known_sums();
  sums.predicted = predicted * sums.values;
  const LogError fitted = fitted_error(sums, ErrorKind::kMean);
  EXPECT_NEAR(error.relmse, std::exp(fitted.middle), 1e-6 * predicted);
  EXPECT_NEAR(error.bounds->low, std::exp(fitted.low), 1e-6 * predicted);
  EXPECT_NEAR(error.bounds->high, std::exp(fitted.high), 1e-6 * predicted);
}

TEST(ErrorInterval, IsNotGivenWithFewGroups) {
  RiskRow sums = known_sums();
  sums.groups = 7;
  EstimatorResult result = with_error(image_of(sums, ErrorKind::kPair));
  EXPECT_EQ(result.interval->unknown, "7 groups of samples are too few; 8 are needed");
}

TEST(ErrorInterval, OfDenoisedMeansOfFewGroupsHasAFitOfItsOwn) {
  RiskRow sums = known_sums();
  sums.groups = 2;
  sums.light_of_largest = 0.7 * sums.light;  // at least half, with two groups
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kFilters).middle, middle_by_hand(sums, kFittedToFew[0].middle), 1e-12);
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kNetwork).middle, middle_by_hand(sums, kFittedToFew[1].middle), 1e-12);
  EXPECT_EQ(unknown_error(sums, ErrorKind::kNetwork, {0, -0.5, 0.5}), "");
  sums.light_of_largest = 0.9 * sums.light;
  EXPECT_EQ(unknown_error(sums, ErrorKind::kNetwork, {0, -0.5, 0.5}),
            "90 % of the light is in one of 2 groups of each pixel");
}

TEST(ErrorInterval, IsThatOfTheTable) {
  const RiskRow sums = known_sums();
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kMean).middle, middle_by_hand(sums, kFittedErrors[0].middle), 1e-12);
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kPairNetwork).middle, middle_by_hand(sums, kFittedErrors[5].middle, 0.95),
              1e-12);
}

TEST(ErrorInterval, OfAMixtureThatIsTheMeanIsAroundItsVariance) {
  RiskRow sums = known_sums();
  sums.variance = sums.noise;
  EXPECT_NEAR(fitted_error(sums, ErrorKind::kFilters).middle, std::log(sums.variance / sums.values), 1e-12);
  EXPECT_NE(fitted_error(sums, ErrorKind::kPair).middle, std::log(sums.variance / sums.values));
}

/// A denoiser removes highlights that few samples found: the variance between its halves is small, R is not.
TEST(ErrorInterval, OfAMixtureReachesToTheRiskThatSamplesTell) {
  for (const ErrorKind kind : {ErrorKind::kFilters, ErrorKind::kNetwork, ErrorKind::kPairFilters}) {
    RiskRow sums = known_sums();
    const double usual = fitted_error(sums, kind).high;
    sums.error = 400, sums.squares = 400 * 400;  // noisy, so that the middle hardly changes
    const double risk = std::log(sums.variance / sums.values) + 0.95 * std::log((400 + 0.27 * 180) / 45);
    const LogError error = fitted_error(sums, kind);
    EXPECT_NEAR(error.high, std::min(risk, error.middle + std::log(kMaxFactor)), 1e-12);
    EXPECT_GT(error.high, usual + 0.1);
    sums.groups = 4;
    const FittedErrors& fit =
        kind == ErrorKind::kPairFilters ? kFittedErrors[4] : kFittedToFew[kind == ErrorKind::kNetwork];
    const LogError few = fitted_error(sums, kind);
    EXPECT_NEAR((few.high - few.middle) / (few.low - few.middle), fit.high / fit.low, 1e-9) << "R is too noisy";
  }
}

TEST(ErrorInterval, IsNotGivenWhereFewPixelsHoldTheNoise) {
  RiskRow sums = known_sums();
  sums.noise_squares = sums.noise * sums.noise / 4;
  EstimatorResult result = with_error(image_of(sums, ErrorKind::kNetwork));
  EXPECT_EQ(result.interval->unknown, "4 of 10000 pixels hold most of the noise");
}

TEST(ErrorInterval, IsWiderWhereFewerPixelsHoldTheNoise) {
  for (const ErrorKind kind : {ErrorKind::kMean, ErrorKind::kPair, ErrorKind::kFilters, ErrorKind::kNetwork,
                               ErrorKind::kPairFilters, ErrorKind::kPairNetwork}) {
    RiskRow few = known_sums();
    few.noise_squares = few.noise * few.noise / 100;  // one hundredth of the pixels
    const LogError error = fitted_error(few, kind), usual = fitted_error(known_sums(), kind);
    EXPECT_GT(error.high - error.low, 1.02 * (usual.high - usual.low)) << static_cast<int>(kind);
    EXPECT_EQ(unknown_error(few, kind, {0, -0.5, 0.5}), "") << "wide, but not refused";
  }
}

TEST(ErrorInterval, IsNotGivenWhereLightIsMissing) {
  RiskRow sums = known_sums();
  sums.light_of_largest = 0.9 * sums.light;
  EstimatorResult result = with_error(image_of(sums, ErrorKind::kNetwork));
  EXPECT_EQ(result.interval->unknown, "90 % of the light is in one of 12 groups of each pixel");
  EXPECT_FALSE(predicted_error(result, 64, 0)->bounds);
  EXPECT_EQ(predicted_error(result, 64, 0)->doubt,
            "no interval can be given: 90 % of the light is in one of 12 groups of each pixel");
}

TEST(ErrorInterval, IsNotGivenWhereMostNoiseIsBehindGlass) {
  RiskRow sums = known_sums();
  sums.specular_noise = 0.49 * sums.noise;
  EXPECT_EQ(unknown_error(sums, ErrorKind::kFilters, {0, -0.5, 0.5}), "");
  sums.specular_noise = 0.67 * sums.noise;
  EXPECT_EQ(unknown_error(sums, ErrorKind::kFilters, {0, -0.5, 0.5}),
            "67 % of the noise is in mirrors or behind glass");
  sums.variance = 0.4 * sums.noise;  // the mixture is the mean in part
  EXPECT_EQ(unknown_error(sums, ErrorKind::kFilters, {0, -0.5, 0.5}), "");
}

TEST(ErrorInterval, IsNotGivenOfBlackImages) {
  EstimatorResult result = with_error(image_of({}, ErrorKind::kFilters));
  EXPECT_EQ(result.interval->unknown, "its samples do not differ");
}

TEST(ErrorInterval, IsNotGivenWhereTheImageKeptFireflies) {
  MethodImage image = image_of(known_sums(), ErrorKind::kNetwork);
  image.estimate = image.std_error = Image(40, 25, 3);
  std::fill(image.estimate.data.begin(), image.estimate.data.end(), 0.5f);
  std::fill(image.std_error.data.begin(), image.std_error.data.end(), 0.02f);
  const EstimatorResult without = with_error(image);
  for (const int x : {10, 11}) {
    std::fill_n(image.estimate.pixel(x, 10), 3, 15000.0f);
    std::fill_n(image.std_error.pixel(x, 10), 3, 14000.0f);
  }
  const EstimatorResult result = with_error(image);
  EXPECT_EQ(without.interval->unknown, "");
  EXPECT_EQ(result.interval->unknown,
            "2 pixels are more than 10 times as bright as those around, by few samples: they may be fireflies");
  const PredictedError predicted = *predicted_error(result, 64, 0);
  EXPECT_FALSE(predicted.bounds);
  EXPECT_NEAR(predicted.relmse, fireflies_in(result).relmse, 1e-6 * predicted.relmse);
  EXPECT_GT(predicted.relmse, 1e4 * predicted_error(without, 64, 0)->relmse);
}

TEST(ErrorInterval, TheLightThatAFireflySpreadsCountsWhereFewPixelsHoldTheNoise) {
  RiskRow sums = known_sums();
  sums.spread = 100 * sums.values;
  EstimatorResult result = with_error(image_of(sums, ErrorKind::kFilters));
  EXPECT_LT(predicted_error(result, 64, 0)->relmse, 1) << "noise in many pixels may be rare light";
  sums.noise_squares = sums.noise * sums.noise / 2;
  result = with_error(image_of(sums, ErrorKind::kFilters));
  EXPECT_EQ(result.interval->unknown, "2 of 10000 pixels hold most of the noise");
  EXPECT_NEAR(predicted_error(result, 64, 0)->relmse, 100, 1e-3);
}

TEST(ErrorInterval, IsNotReliableBeyondAFactorOfOneAndAHalf) {
  EstimatorResult result = image_of(known_sums(), ErrorKind::kFilters);
  result.interval = ErrorInterval{1, 0.7, 1.49, ""};
  EXPECT_EQ(predicted_error(result, 64, 0)->doubt, "");
  result.interval = ErrorInterval{1, 0.7, 1.6, ""};
  EXPECT_EQ(predicted_error(result, 64, 0)->doubt, "known to a factor of 1.6");
  result.interval = ErrorInterval{1, 0.5, 1.2, ""};
  EXPECT_EQ(predicted_error(result, 64, 0)->doubt, "known to a factor of 2");
}

TEST(ErrorInterval, HasFeaturesThatDoNotChangeWithBrightnessOrSize) {
  RiskRow large = known_sums();
  for (const auto& [name, sum] : kRiskSums)
    if (sum != &RiskRow::groups) large.*sum *= 4;  // four times as many rows
  const ErrorFeatures a = error_features(known_sums()), b = error_features(large);
  for (const size_t i : {0, 3, 4, 5, 7, 8}) EXPECT_NEAR(a[i], b[i], 1e-12) << i;
  EXPECT_LT(b[2], a[2]) << "more pixels hide less";
}

}  // namespace
}  // namespace covary
