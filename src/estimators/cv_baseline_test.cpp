// SPDX-License-Identifier: Apache-2.0
// Plain control variates (baseline) against the double-precision reference; identities; degenerate inputs.
#include "estimators/cv_baseline.h"

#include <gtest/gtest.h>

#include "core/error.h"
#include "estimators/compare_with_reference.h"
#include "estimators/test_images.h"
#include "support/files.h"

namespace covary {
namespace {

using reference::compare, reference::neighbours, reference::pilot_of, reference::RgbImage;
using test_support::message_of;

TEST(CvBaseline, WithARidgeAgreesWithTheReference) {
  const test::Grouped crn = test::crn_image(41, 27, 12, 1), independent = test::independent_image(41, 27, 12, 2);
  const RgbImage unused = pilot_of(crn.view(), independent.view(), 11);
  for (bool shared : {false, true}) {
    CvBaselineOptions options;
    options.ridge = 0.05f;
    options.shared_coefficients = shared;
    const EstimatorResult fast = cv_baseline(crn.view(), independent.view(), options);
    EXPECT_LT(compare(fast, crn.view(), independent.view(), unused, 25, 11, {shared, false, 0.05, 0}).estimate, 2e-3);
  }
}

/// Minimum norm: compared with the pseudo-inverse.
TEST(CvBaseline, WithoutRidgeIsTheMinimumNormSolution) {
  const test::Grouped crn = test::crn_image(30, 20, 12, 1), independent = test::independent_image(30, 20, 12, 2);
  const GroupedImage view = crn.view(), independent_view = independent.view();
  const auto all = neighbours(view, 25, 11);
  const EstimatorResult fast = cv_baseline(view, independent_view);
  for (int y = 0; y < view.height; ++y)
    for (int x = 0; x < view.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const auto& near = all[y * view.width + x];
        Eigen::MatrixXd X(12, 25);
        Eigen::VectorXd target(12), difference(25);
        for (int t = 0; t < 12; ++t) {
          target(t) = view.pixel(x, y)[3 * t + c];
          for (int i = 0; i < 25; ++i) X(t, i) = view.pixel(near[i].x, near[i].y)[3 * t + c];
        }
        const double f = target.mean();
        for (int i = 0; i < 25; ++i)
          difference(i) = X.col(i).mean() - reference::mean(independent_view, near[i].x, near[i].y)[c];
        target.array() -= f;
        X.rowwise() -= X.colwise().mean().eval();
        const Eigen::VectorXd beta = X.completeOrthogonalDecomposition().solve(target);
        const double noise = std::sqrt(reference::variance_of_mean(view, x, y)[c]);
        EXPECT_NEAR(fast.estimate.pixel(x, y)[c], f - beta.dot(difference), 0.02 * noise) << x << ", " << y;
      }
}

/// Least squares with shared coefficients and the target among the neighbours selects the target itself.
TEST(CvBaseline, WithSharedCoefficientsIsTheIndependentImage) {
  const test::Grouped crn = test::crn_image(30, 20, 12, 1), independent = test::independent_image(30, 20, 12, 2);
  CvBaselineOptions options;
  options.shared_coefficients = true;
  const EstimatorResult fast = cv_baseline(crn.view(), independent.view(), options);
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 30; ++x)
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(fast.estimate.pixel(x, y)[c], reference::mean(independent.view(), x, y)[c], 5e-3) << x << ", " << y;
}

/// A sky: bright, with hardly any noise beyond rounding. The minimum-norm solution must not amplify it.
TEST(CvBaseline, SmallestNormIsBoundedWherePixelsHardlyVary) {
  test::Grouped crn = test::crn_image(60, 40, 12, 3), independent = test::independent_image(60, 40, 12, 4);
  for (float noise : {0.0f, 1e-7f, 1e-6f, 1e-4f, 1e-2f}) {
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 60; ++x)
        for (int i = 0; i < 36; ++i) {
          crn.pixel(x, y)[i] = 3.0f * (1 + noise * test::noise(7, i, x));
          independent.pixel(x, y)[i] = 3.0f * (1 + noise * test::noise(8, i + 36 * y, x));
        }
    const EstimatorResult result = cv_baseline(crn.view(), independent.view());
    for (float v : result.estimate.data) ASSERT_NEAR(v, 3.0f, 30 * noise + 1e-5f) << noise;
  }
}

TEST(CvBaseline, BlackIsBlack) {
  const test::Grouped black = test::constant_image(30, 20, 12, 0.0f);
  const EstimatorResult result = cv_baseline(black.view(), black.view());
  for (float v : result.estimate.data) ASSERT_EQ(v, 0.0f);
}

TEST(CvBaseline, ReportsEveryProblemAtOnce) {
  const test::Grouped two = test::constant_image(8, 6, 2, 1), one = test::constant_image(8, 5, 1, 1);
  EXPECT_EQ(message_of([&] { cv_baseline(one.view(), one.view()); }, ErrorCode::kUsage),
            "cv_baseline: the CRN image has 1 group, at least 3 are needed (12 are recommended)");
  CvBaselineOptions options;
  options.window = 3;
  options.k = 16;
  EXPECT_EQ(message_of([&] { cv_baseline(two.view(), two.view(), options); }, ErrorCode::kUsage),
            "cv_baseline: k is 16, expected 1 to 9, the number of pixels in a window of 3 x 3; the CRN image has 2 "
            "groups, at least 3 are needed (12 are recommended)");
}

}  // namespace
}  // namespace covary
