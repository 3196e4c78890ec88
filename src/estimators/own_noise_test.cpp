// SPDX-License-Identifier: Apache-2.0
// The covariance of IICV's result with the independent image at the same pixel, against finite differences of the
// estimator: one pixel's mean and variance are changed as a larger weight of each of its groups would change them.
#include "estimators/own_noise.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "estimators/iicv.h"
#include "estimators/test_images.h"

namespace covary {
namespace {

constexpr int kWidth = 26, kHeight = 22;
using Rgb = std::array<double, 3>;

/// Mean and variance of the mean of each channel at a pixel.
struct Own {
  Rgb mean{}, variance{};
};

Own own_of(test::Grouped& image, int x, int y) {
  const int n = image.groups;
  const float* p = image.pixel(x, y);
  Own own;
  for (int c = 0; c < 3; ++c) {
    for (int t = 0; t < n; ++t) own.mean[c] += static_cast<double>(p[3 * t + c]) / n;
    for (int t = 0; t < n; ++t) own.variance[c] += std::pow(p[3 * t + c] - own.mean[c], 2) / (n * (n - 1.0));
  }
  return own;
}

/// The result at a pixel whose groups have this mean and variance instead of their own.
Rgb result_with(const test::Grouped& crn, test::Grouped independent, const IicvOptions& options, int x, int y,
                const Own& wanted) {
  const Own own = own_of(independent, x, y);
  float* p = independent.pixel(x, y);
  for (int t = 0; t < independent.groups; ++t)
    for (int c = 0; c < 3; ++c)
      p[3 * t + c] = static_cast<float>(wanted.mean[c] +
                                        (p[3 * t + c] - own.mean[c]) * std::sqrt(wanted.variance[c] / own.variance[c]));
  const EstimatorResult result = iicv(crn.view(), independent.view(), options);
  const float* f = result.estimate.pixel(x, y);
  return {f[0], f[1], f[2]};
}

/// Half the difference between the results for both signs of a change, over its size.
Rgb derivative(const test::Grouped& crn, const test::Grouped& independent, const IicvOptions& options, int x, int y,
               const Own& own, const Rgb& of_mean, const Rgb& of_variance) {
  constexpr double kStep = 0.01;
  std::array<Rgb, 2> results;
  for (int sign : {0, 1}) {
    Own changed = own;
    for (int c = 0; c < 3; ++c) {
      changed.mean[c] += (sign ? kStep : -kStep) * of_mean[c];
      changed.variance[c] += (sign ? kStep : -kStep) * of_variance[c];
    }
    results[sign] = result_with(crn, independent, options, x, y, changed);
  }
  Rgb slope;
  for (int c = 0; c < 3; ++c) slope[c] = (results[1][c] - results[0][c]) / (2 * kStep);
  return slope;
}

/// cov(F^, h) at a pixel, by finite differences.
Rgb covariance_at(const test::Grouped& crn, test::Grouped independent, const IicvOptions& options, int x, int y) {
  const int n = independent.groups;
  const Own own = own_of(independent, x, y);
  Rgb covariance{};
  for (int t = 0; t < n; ++t) {
    Rgb deviation, of_variance;
    for (int c = 0; c < 3; ++c) {
      deviation[c] = independent.pixel(x, y)[3 * t + c] - own.mean[c];
      of_variance[c] = deviation[c] * deviation[c] / (n - 1) - own.variance[c];
    }
    const Rgb by_mean = derivative(crn, independent, options, x, y, own, deviation, {}),
              by_variance = derivative(crn, independent, options, x, y, own, {}, of_variance);
    // The third moment has n - 2 degrees of freedom.
    for (int c = 0; c < 3; ++c)
      covariance[c] += deviation[c] * (by_mean[c] / (n * (n - 1.0)) + by_variance[c] / (n * (n - 2.0)));
  }
  return covariance;
}

constexpr std::pair<int, int> kTargets[] = {{3, 4}, {9, 9}, {12, 15}, {0, 0}, {20, 7}, {25, 21}, {16, 3}};

/// The CRN image with much noise in the targets and little elsewhere: their pilots are wide, and no other pixel's
/// contains them, so that the covariance has no part that is left out.
test::Grouped with_noise_in_targets(test::Grouped crn) {
  std::vector<float> scale(static_cast<size_t>(kWidth) * kHeight, 0.05f);
  for (const auto& [x, y] : kTargets) scale[static_cast<size_t>(y) * kWidth + x] = 8;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Own own = own_of(crn, x, y);
      for (int i = 0; i < 3 * crn.groups; ++i) {
        const auto mean = static_cast<float>(own.mean[i % 3]);
        crn.pixel(x, y)[i] = mean + scale[static_cast<size_t>(y) * kWidth + x] * (crn.pixel(x, y)[i] - mean);
      }
    }
  return crn;
}

struct Case {
  std::string what;
  IicvOptions options;
  int groups;
  double tolerance;  ///< relative, of the sum of absolute differences
  bool noisy_targets = false;
};

std::vector<Case> cases() {
  IicvOptions paper = IicvOptions::paper();
  // Pilots of other pixels and, by default, missing light are left out.
  std::vector<Case> all = {{"default", IicvOptions(), 12, 0.16}, {"paper", paper, 12, 0.12}};
  all.push_back({"paper, exact", paper, 12, 0.02, true});
  IicvOptions options = paper;
  options.shared_coefficients = false;
  all.push_back({"a coefficient for each channel", options, 12, 0.02, true});
  options = paper;
  options.penalty = Penalty::kAsymmetric;
  all.push_back({"asymmetric", options, 12, 0.02, true});
  options = paper;
  options.penalty = Penalty::kSample;
  all.push_back({"sample variances", options, 12, 0.01});
  options.k = 50, options.window = 11;
  all.push_back({"fewer rows than neighbours", options, 5, 0.01});
  options = IicvOptions();
  options.residual_correction = false;
  all.push_back({"without residual correction", options, 12, 0.12});
  options.k = 40;
  all.push_back({"the same, fewer rows than neighbours", options, 8, 0.12});
  return all;
}

TEST(OwnNoise, AgreesWithFiniteDifferences) {
  for (Case& test_case : cases()) {
    const test::Grouped usual = test::crn_image(kWidth, kHeight, test_case.groups, 1),
                        crn = test_case.noisy_targets ? with_noise_in_targets(usual) : usual,
                        independent = test::independent_image(kWidth, kHeight, test_case.groups, 2);
    const IicvOptions options = test_case.options;
    test_case.options.covariance = true;
    const EstimatorResult result = iicv(crn.view(), independent.view(), test_case.options);
    const EstimatorResult without = iicv(crn.view(), independent.view(), options);
    EXPECT_EQ(result.estimate.data, without.estimate.data) << test_case.what;
    EXPECT_TRUE(without.covariance.data.empty());
    double off = 0, sum = 0;
    for (const auto& [x, y] : kTargets) {
      const Rgb expected = covariance_at(crn, independent, options, x, y);
      for (int c = 0; c < 3; ++c) {
        off += std::abs(result.covariance.pixel(x, y)[c] - expected[c]);
        sum += std::abs(expected[c]);
      }
    }
    EXPECT_LT(off, test_case.tolerance * sum) << test_case.what << ": " << off / sum;
  }
}

/// A coefficient that does not depend on the samples is the covariance over their variance.
TEST(OwnNoise, OfTheIndependentImageItselfIsItsVariance) {
  const test::Grouped crn = test::crn_image(kWidth, kHeight, 12, 1),
                      independent = test::independent_image(kWidth, kHeight, 12, 2);
  IicvOptions options = IicvOptions::paper();
  options.k = 1, options.penalty = Penalty::kSample;
  options.covariance = true;
  test::Grouped exact = independent;  // the same deviations, a thousandth as large: the coefficient is 1
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const Own own = own_of(exact, x, y);
      for (int i = 0; i < 36; ++i)
        exact.pixel(x, y)[i] = static_cast<float>(own.mean[i % 3] + 1e-3 * (exact.pixel(x, y)[i] - own.mean[i % 3]));
    }
  const EstimatorResult result = iicv(crn.view(), exact.view(), options);
  for (const auto& [x, y] : {std::pair{5, 5}, {20, 15}}) {
    const Own own = own_of(exact, x, y);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(result.covariance.pixel(x, y)[c] / own.variance[c], 1, 0.01) << x << ", " << y;
  }
}

}  // namespace
}  // namespace covary
