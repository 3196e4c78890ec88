// SPDX-License-Identifier: Apache-2.0
// Numbers of samples from the noise of a first pass: budgets, classes, limits, and noise-free images.
#include "estimators/sample_counts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/random.h"
#include "estimators/test_images.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of;

constexpr double kNoLimit = std::numeric_limits<double>::infinity();
constexpr int kWidth = 40, kHeight = 25;

/// Two groups of one sample each, brightness 0.1 … 5, relative standard deviations 0.02 … 3.
test::Grouped noisy_first_pass() {
  test::Grouped image = test::constant_image(kWidth, kHeight, 2, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const auto pixel = static_cast<uint64_t>(y * kWidth + x);
      const float brightness = 0.1f * std::pow(50.0f, test::noise(1, pixel, 0) + 0.5f);
      const float deviation = 0.02f * std::pow(150.0f, test::noise(1, pixel, 1) + 0.5f);
      for (int c = 0; c < 3; ++c) {
        image.pixel(x, y)[c] = brightness * (1 + deviation);
        image.pixel(x, y)[3 + c] = std::max(0.0f, brightness * (1 - deviation));
      }
    }
  return image;
}

CountOptions options_of(Allocation allocation, int smoothing = 1) {
  CountOptions options;
  options.allocation = allocation;
  options.smoothing = smoothing;
  return options;
}

double mean(const std::vector<uint32_t>& counts) {
  return std::accumulate(counts.begin(), counts.end(), 0.0) / static_cast<double>(counts.size());
}

TEST(SampleCounts, ClassesAreThoseOfThePaperAndGoOn) {
  EXPECT_EQ(class_of(0), 0u);
  EXPECT_EQ(class_of(-3), 0u);
  EXPECT_EQ(class_of(0.2), 1u);
  EXPECT_EQ(class_of(1.5), 10u);
  EXPECT_EQ(class_of(10), 10u);
  EXPECT_EQ(class_of(10.5), 20u);
  EXPECT_EQ(class_of(21), 50u);
  EXPECT_EQ(class_of(51), 100u);
  EXPECT_EQ(class_of(101), 200u);
  EXPECT_EQ(class_of(40000), 50000u);
}

TEST(SampleCounts, MeetTheBudget) {
  const test::Grouped image = noisy_first_pass();
  for (const Allocation allocation : {Allocation::kEqualError, Allocation::kMinError, Allocation::kUniform})
    for (const bool classes : {false, true})
      for (const double budget : {3.0, 17.5, 46.0, 900.0}) {
        CountOptions options = options_of(allocation);
        options.classes = classes;
        const bool all_equal = classes && allocation == Allocation::kUniform;
        EXPECT_NEAR(mean(sample_counts(image.view(), budget, options)), all_equal ? std::floor(budget) : budget,
                    0.01 * budget)
            << static_cast<int>(allocation) << classes;
      }
}

TEST(SampleCounts, UniformIsTheSameForAll) {
  const test::Grouped image = noisy_first_pass();
  for (const uint32_t n : sample_counts(image.view(), 43, options_of(Allocation::kUniform))) EXPECT_EQ(n, 43u);
  // The published filter ignores neighbours with other numbers, so that a pattern of two classes would disable it.
  CountOptions classes = options_of(Allocation::kUniform);
  classes.classes = true;
  for (const double budget : {43.0, 43.9})
    for (const uint32_t n : sample_counts(image.view(), budget, classes)) ASSERT_EQ(n, 43u);
  for (const uint32_t n : sample_counts(image.view(), 43.9, classes, 12)) ASSERT_EQ(n, 36u);
}

TEST(SampleCounts, KeepToTheLargestNumberInMultiplesToo) {
  const test::Grouped image = noisy_first_pass();
  CountOptions options = options_of(Allocation::kMinError);
  options.max_spp = 31;
  for (const uint32_t n : sample_counts(image.view(), 900, options, 12)) ASSERT_EQ(n, 24u);
  const auto message = [&] { return message_of([&] { sample_counts(image.view(), 900, options, 12); }); };
  options.max_spp = 11;
  EXPECT_TRUE(contains(message(), "`max-spp` is 11, expected at least 12, one sample for each group")) << message();
  options.min_spp = 25, options.max_spp = 35;
  EXPECT_TRUE(contains(message(), "max-spp` is 35, expected at least 36")) << message();
}

TEST(SampleCounts, SayWhetherTheRelativeErrorIsReached) {
  const test::Grouped image = noisy_first_pass();
  for (const Allocation allocation : {Allocation::kEqualError, Allocation::kMinError, Allocation::kUniform}) {
    CountOptions options = options_of(allocation);
    EXPECT_TRUE(have_relative_error(image.view(), sample_counts(image.view(), 9, options), options));
    options.relative_error = 0.5f;
    const std::vector<uint32_t> enough = sample_counts(image.view(), kNoLimit, options);
    EXPECT_TRUE(have_relative_error(image.view(), enough, options));
    EXPECT_FALSE(have_relative_error(image.view(), sample_counts(image.view(), 0.9 * mean(enough), options), options));
    options.max_spp = static_cast<int>(*std::max_element(enough.begin(), enough.end())) - 1;
    EXPECT_FALSE(have_relative_error(image.view(), sample_counts(image.view(), kNoLimit, options), options));
  }
}

TEST(SampleCounts, EqualErrorIsThePublishedFormula) {
  const test::Grouped image = noisy_first_pass();
  CountOptions options = options_of(Allocation::kEqualError);
  options.relative_error = 0.3f;
  options.min_spp = 0;
  const std::vector<uint32_t> counts = sample_counts(image.view(), kNoLimit, options);
  options.classes = true;
  const std::vector<uint32_t> classes = sample_counts(image.view(), kNoLimit, options);
  for (int p = 0; p < kWidth * kHeight; ++p) {
    const float* v = image.view().pixel(p % kWidth, p / kWidth);
    const double C = 3 * 0.5 * (double{v[0]} + v[3]), sigma = 3 * std::abs(double{v[0]} - v[3]) / std::sqrt(2.0);
    const double N = std::pow(3 * sigma / (0.3f * C), 2) - 2;
    EXPECT_NEAR(counts[p], std::max(0.0, std::ceil(N)), 1 + 1e-4 * std::max(0.0, N));
    EXPECT_EQ(classes[p], class_of(classes[p])) << "a class";
    EXPECT_GE(classes[p] + 1, counts[p]);
  }
}

/// Sec. 3 of [Csonka2002], with sigma^2 of Sec. 5 in either norm.
TEST(SampleCounts, CanBeProportionalToVarianceOverColour) {
  const test::Grouped image = noisy_first_pass();
  CountOptions options = options_of(Allocation::kVariance);
  options.min_spp = 0;
  for (const Norm norm : {Norm::kSum, Norm::kEuclidean}) {
    options.norm = norm;
    const std::vector<uint32_t> counts = sample_counts(image.view(), 10000, options);
    std::vector<double> demand;
    double sum = 0;
    for (int p = 0; p < kWidth * kHeight; ++p) {
      const float* v = image.view().pixel(p % kWidth, p / kWidth);  // two samples, the same in all channels
      const double factor = norm == Norm::kSum ? 3 : std::sqrt(3.0);
      const double C = factor * 0.5 * (double{v[0]} + v[3]), deviation = factor * (double{v[0]} - v[3]);
      sum += demand.emplace_back(deviation * deviation / 2 / C);
    }
    for (int p = 0; p < kWidth * kHeight; ++p) {
      const double wanted = 10000.0 * kWidth * kHeight * demand[p] / sum;
      EXPECT_NEAR(counts[p], wanted, 1 + 1e-4 * wanted);
    }
  }
  options.relative_error = 0.1f;
  EXPECT_TRUE(contains(message_of([&] { sample_counts(image.view(), 9, options); }), "`allocation` is variance"));
}

TEST(SampleCounts, LeastErrorIsProportionalToTheRootOfRelativeDeviation) {
  const test::Grouped image = noisy_first_pass();
  const std::vector<uint32_t> counts = sample_counts(image.view(), 10000, options_of(Allocation::kMinError));
  const auto ratio = [&](int p) {
    const float* v = image.view().pixel(p % kWidth, p / kWidth);
    const double C = 1.5 * (double{v[0]} + v[3]), sigma = 3 * std::abs(double{v[0]} - v[3]) / std::sqrt(2.0);
    return std::sqrt(sigma / std::sqrt(C * C + 0.01));
  };
  std::vector<double> shares;
  for (int p = 0; p < kWidth * kHeight; ++p) shares.push_back(ratio(p));
  const auto mean_of = [](const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  };
  const double mean_ratio = mean_of(shares);
  for (double& share : shares) share = std::clamp(share / mean_ratio, 0.7, 2.0);
  const double mean_share = mean_of(shares);
  for (size_t p = 0; p < counts.size(); ++p)
    EXPECT_NEAR(counts[p], 10000 * shares[p] / mean_share, 2 + 1e-4 * counts[p]) << p;
}

/// The requested error is the root mean square over all pixels.
TEST(SampleCounts, UniformHasTheRelativeErrorOnAverage) {
  const test::Grouped image = noisy_first_pass();
  CountOptions options = options_of(Allocation::kUniform);
  options.relative_error = 0.05f;
  const std::vector<uint32_t> counts = sample_counts(image.view(), kNoLimit, options);
  double squares = 0;
  for (int p = 0; p < kWidth * kHeight; ++p) {
    const float* v = image.view().pixel(p % kWidth, p / kWidth);
    const double C = 1.5 * (double{v[0]} + v[3]), sigma = 3 * std::abs(double{v[0]} - v[3]) / std::sqrt(2.0);
    squares += 9 * sigma * sigma / (C * C + 0.01) / counts[p];
  }
  EXPECT_NEAR(std::sqrt(squares / (kWidth * kHeight)), 0.05, 0.001);
}

TEST(SampleCounts, ARelativeErrorIsLimitedByTheBudget) {
  const test::Grouped image = noisy_first_pass();
  CountOptions options = options_of(Allocation::kEqualError);
  options.relative_error = 0.001f;
  EXPECT_NEAR(mean(sample_counts(image.view(), 30, options)), 30, 0.3);
  options.relative_error = 10.0f;
  EXPECT_LT(mean(sample_counts(image.view(), 30, options)), 3) << "less than the budget where less is enough";
}

TEST(SampleCounts, KeepLimits) {
  const test::Grouped image = noisy_first_pass();
  CountOptions options = options_of(Allocation::kEqualError);
  options.min_spp = 7, options.max_spp = 61;
  for (const double budget : {2.0, 20.0, 500.0})
    for (const uint32_t n : sample_counts(image.view(), budget, options)) EXPECT_TRUE(n >= 7 && n <= 61) << n;
  options.min_spp = 1;
  for (const uint32_t n : sample_counts(image.view(), 40, options, 12)) EXPECT_TRUE(n % 12 == 0 && n > 0) << n;
}

TEST(SampleCounts, OfImagesWithoutNoise) {
  for (const float value : {0.0f, 1.0f}) {  // black, too
    const test::Grouped image = test::constant_image(8, 8, 2, value);
    for (const uint32_t n : sample_counts(image.view(), 20, options_of(Allocation::kMinError))) EXPECT_EQ(n, 20u);
    CountOptions paper = options_of(Allocation::kEqualError);
    paper.min_spp = 0;
    for (const uint32_t n : sample_counts(image.view(), 20, paper)) EXPECT_EQ(n, 0u);
  }
  const test::Grouped one = test::constant_image(4, 4, 1, 1);
  for (const uint32_t n : sample_counts(one.view(), 20, options_of(Allocation::kMinError))) EXPECT_EQ(n, 20u);
}

/// Equal pixels cannot all be rounded to the budget: some get the next class.
TEST(SampleCounts, EqualPixelsShareABudgetBetweenClasses) {
  test::Grouped image = test::constant_image(20, 20, 2, 1);
  for (size_t i = 0; i < image.data.size(); i += 6) image.data[i] = 2;
  CountOptions options = options_of(Allocation::kEqualError);
  options.classes = true;
  const std::vector<uint32_t> counts = sample_counts(image.view(), 34, options);
  EXPECT_NEAR(mean(counts), 34, 0.34);
  for (const uint32_t n : counts) EXPECT_TRUE(n == 20 || n == 50) << n;
}

TEST(SampleCounts, PixelsThatAreNotFiniteHaveNoNoise) {
  test::Grouped image = noisy_first_pass();
  image.data[1] = std::numeric_limits<float>::quiet_NaN();
  image.data[7] = std::numeric_limits<float>::infinity();
  const std::vector<uint32_t> counts = sample_counts(image.view(), 30, options_of(Allocation::kMinError));
  EXPECT_NEAR(mean(counts), 30, 0.3);
}

/// Four times the squared error, twice the samples, including those of the first pass; limits on both sides.
TEST(SampleCounts, OfAFilteredImageFollowTheRootOfItsErrorAndTopUp) {
  constexpr int kSide = 96, kFirst = 8;
  const test::Grouped first = test::constant_image(kSide, kSide, kFirst, 1);
  CountOptions options = options_of(Allocation::kDenoised);
  const auto counts_of = [&](double left, double right) {
    std::vector<double> errors(kSide * kSide, left);
    for (int i = 0; i < kSide * kSide; ++i)
      if (i % kSide >= kSide / 2) errors[static_cast<size_t>(i)] = right;
    return sample_counts(first.view(), 40, options, 1, errors);
  };
  const auto at = [](const std::vector<uint32_t>& counts, int x) { return counts[48 * kSide + x]; };
  options.tops_up = true;
  std::vector<uint32_t> counts = counts_of(0.01, 0.04);
  EXPECT_NEAR(mean(counts), 40, 0.01);
  EXPECT_NEAR(at(counts, 5), 24, 1) << "32 with those of the first pass";
  EXPECT_NEAR(at(counts, 90), 56, 1) << "64 with those of the first pass";
  counts = counts_of(0.01, 1);
  EXPECT_NEAR((at(counts, 90) + 8.0) / (at(counts, 5) + 8.0), 1.82 / 0.5, 0.2) << "no pixel less than half of the mean";
  options.tops_up = false;
  counts = counts_of(0.01, 0.04);
  EXPECT_NEAR(at(counts, 5), 26.7, 1);
  EXPECT_NEAR(at(counts, 90), 53.3, 1);
}

}  // namespace
}  // namespace covary
