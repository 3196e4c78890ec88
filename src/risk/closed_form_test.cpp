// SPDX-License-Identifier: Apache-2.0
// The squared error of IICV's image from its covariance with the samples, against the truth of synthetic images and
// against halves of the samples.
#include <gtest/gtest.h>

#include <cmath>
#include <variant>

#include "combine/registry.h"
#include "estimators/test_images.h"
#include "risk/held_out_error.h"
#include "risk/image_risk.h"

namespace covary {
namespace {

constexpr int kWidth = 96, kHeight = 64, kRuns = 12;

/// `iicv`, whose covariance is withheld, as by devices.
Method by_halves() {
  Method estimator = make_estimator("iicv");
  PassPair& pair = std::get<PassPair>(estimator.passes);
  pair.image = [image = pair.image](const GroupedImage& g, const GroupedImage& h, const MethodSettings& settings) {
    MethodSettings alone = settings;
    alone.held_out = false;
    return image(g, h, alone);
  };
  return with_held_out_rows(estimator);
}

/// `brighter`: the picture with outliers over that without.
double true_error(const Image& image, double brighter) {
  double sum = 0;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const float* p = image.pixel(x, y);
      const double grey = (double{p[0]} + p[1] + p[2]) / 3;
      for (int c = 0; c < 3; ++c) sum += std::pow(p[c] - brighter * test::expected(x, y, c), 2) / (grey * grey + 0.01);
    }
  return sum;
}

struct Sums {
  double truth = 0, of_closed = 0, of_halves = 0, variance = 0, variance_of_halves = 0;
};

/// `missing`: fraction of the covariance that halves miss.
Sums sums_with(float outliers, double missing) {
  const Method closed = make_estimator("iicv"), halves = by_halves();
  MethodSettings settings;
  settings.std_error = true;
  Sums sums;
  for (uint64_t run = 0; run < kRuns; ++run) {
    const test::Grouped crn = test::noisy_image(kWidth, kHeight, 12, 2 * run, 0.2f, outliers),
                        independent = test::noisy_image(kWidth, kHeight, 12, 2 * run + 1001, 1.0f, outliers);
    const MethodImage image = closed.image({crn.view(), independent.view()}, settings),
                      same = halves.image({crn.view(), independent.view()}, settings);
    EXPECT_EQ(image.estimate.data, same.estimate.data);
    EXPECT_EQ(image.risk_kind, ErrorKind::kPair);
    EXPECT_EQ(same.risk_kind, ErrorKind::kPairHalves);
    EXPECT_TRUE(image.bias.data.empty()) << "only halves show it";
    EXPECT_FALSE(same.bias.data.empty());
    const RiskRow a = sum_of(image.risk_rows), b = sum_of(same.risk_rows);
    EXPECT_EQ(a.noise, b.noise);
    sums.truth += true_error(image.estimate, 1 + 5 * outliers);
    sums.of_closed += a.error;
    sums.of_halves += b.error + missing * b.covariance;
    sums.variance += a.variance, sums.variance_of_halves += b.variance;
  }
  return sums;
}

TEST(ClosedForm, IsTheErrorOfTheImageAndAgreesWithHalves) {
  const Sums sums = sums_with(0, 0);
  EXPECT_NEAR(sums.of_closed / sums.truth, 1, 0.15);
  EXPECT_NEAR(sums.of_closed / sums.of_halves, 1, 0.25) << "halves over truth " << sums.of_halves / sums.truth;
  EXPECT_NEAR(sums.variance / sums.variance_of_halves, 1, 0.2);
}

/// Rare bright samples, which penalties follow beyond first order.
TEST(ClosedForm, IsOfTheErrorsSizeWithOutliers) {
  const Sums sums = sums_with(0.01f, 0.27);  // as in error_interval.cpp
  EXPECT_NEAR(std::log(sums.of_closed / sums.truth), 0, std::log(1.5));
  EXPECT_NEAR(std::log(sums.of_closed / sums.of_halves), 0, std::log(1.5)) << sums.of_halves / sums.truth;
}

TEST(ClosedForm, NeedsAsManyGroupsAsHalvesDo) {
  MethodSettings settings;
  settings.std_error = true;
  for (const int groups : {5, 6}) {
    const test::Grouped crn = test::crn_image(kWidth, 8, groups, 1),
                        independent = test::independent_image(kWidth, 8, groups, 2);
    const MethodImage image = make_estimator("iicv").image({crn.view(), independent.view()}, settings);
    EXPECT_EQ(image.risk_rows.size(), groups < 6 ? 0u : 8u);
    EXPECT_TRUE(image.covariance.data.empty());
  }
}

}  // namespace
}  // namespace covary
