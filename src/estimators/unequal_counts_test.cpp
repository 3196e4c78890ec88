// SPDX-License-Identifier: Apache-2.0
// Counts of samples: groups of unequal sizes within a pixel, and pixels with unequal counts. If all are equal, counts
// do not change a bit; otherwise estimators agree with the double-precision reference, weighted as their headers say.
#include <gtest/gtest.h>

#include "core/error.h"
#include "estimators/compare_with_reference.h"
#include "estimators/control_variates.h"
#include "estimators/cv_baseline.h"
#include "estimators/examine_inputs.h"
#include "estimators/iduw.h"
#include "estimators/iicv.h"
#include "estimators/mean.h"
#include "estimators/reference_residual_correction.h"
#include "estimators/test_images.h"
#include "film/groups.h"
#include "support/files.h"

namespace covary {
namespace {

using reference::compare, reference::Difference, reference::Rgb, reference::RgbImage;
using test_support::contains, test_support::message_of;

constexpr int kWidth = 41, kHeight = 27, kGroups = 12;

/// The same count everywhere or, with `spread`, pseudo-random counts from `count` to count + spread - 1.
test::Grouped with_counts(test::Grouped image, uint32_t count, uint32_t spread = 1) {
  image.counts.resize(static_cast<size_t>(image.width) * image.height);
  for (size_t i = 0; i < image.counts.size(); ++i)
    image.counts[i] = count + static_cast<uint32_t>(mix64(i + 3) % spread);
  return image;
}
test::Grouped crn_image() { return test::crn_image(kWidth, kHeight, kGroups, 1); }
test::Grouped independent_image() { return test::independent_image(kWidth, kHeight, kGroups, 2); }

bool same(const EstimatorResult& a, const EstimatorResult& b) {
  return a.estimate.data == b.estimate.data && a.std_error.data == b.std_error.data;
}

TEST(UnequalCounts, EqualOnesChangeNoBit) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  const test::Grouped crn_counted = with_counts(crn, 24), independent_counted = with_counts(independent, 36);
  for (const Penalty penalty : {Penalty::kPilot, Penalty::kSample}) {
    IicvOptions options;
    options.penalty = penalty;
    options.std_error = true;
    EXPECT_TRUE(same(iicv(crn.view(), independent.view(), options),
                     iicv(crn_counted.view(), independent_counted.view(), options)));
  }
  EXPECT_TRUE(
      same(cv_baseline(crn.view(), independent.view()), cv_baseline(crn_counted.view(), independent_counted.view())));
  IduwOptions options;
  options.samples = 24;
  EXPECT_TRUE(same(iduw(crn.view(), independent.view(), options),
                   iduw(crn_counted.view(), independent_counted.view(), options)));
  EXPECT_TRUE(same(mean_of_groups(crn.view()), mean_of_groups(crn_counted.view())));
  const InputReport a = examine_inputs(crn.view(), independent.view()),
                    b = examine_inputs(crn_counted.view(), independent_counted.view());
  EXPECT_EQ(a.crn_mean, b.crn_mean);
  EXPECT_EQ(a.mean_difference_sigmas, b.mean_difference_sigmas);
}

/// Results of the reference for the defaults or the published settings.
struct Expected {
  RgbImage estimate, std_error;
};
Expected reference_result(const GroupedImage& crn, const GroupedImage& independent,
                          const reference::Settings& settings) {
  const RgbImage h =
      reference::map_pixels(independent, [&](int x, int y) { return reference::mean(independent, x, y); });
  const RgbImage variance =
      reference::map_pixels(independent, [&](int x, int y) { return reference::variance_of_mean(independent, x, y); });
  const RgbImage error = reference::pilot_of(crn, independent, 11);
  const auto all = reference::neighbours(crn, 25, 11);
  Expected expected;
  for (int y = 0; y < crn.height; ++y)
    for (int x = 0; x < crn.width; ++x) {
      const reference::Result r =
          reference::control_variates(crn, h, error, variance, {x, y}, all[y * crn.width + x], settings);
      expected.estimate.push_back(r.estimate);
      expected.std_error.push_back(r.std_error);
    }
  if (settings.mean_constraint > 0)
    expected.estimate = reference::residual_correction(expected.estimate, expected.std_error, h, variance, crn.width,
                                                       crn.height, 41, 1.25, independent);
  return expected;
}

// Groups of sizes 1 and 2 in both images; counts that differ between pixels of the independent image, of both, and of
// the CRN image only.
TEST(UnequalCounts, IicvAgreesWithTheReference) {
  const test::Grouped crn = crn_image(), independent = independent_image();
  struct Case {
    test::Grouped crn, independent;
  };
  for (const Case& c :
       {Case{with_counts(crn, 13), with_counts(independent, 19)}, Case{crn, with_counts(independent, 12, 200)},
        Case{with_counts(crn, 12, 40), with_counts(independent, 12, 40)}, Case{with_counts(crn, 96, 5), independent}}) {
    for (const bool paper : {true, false}) {
      IicvOptions options = paper ? IicvOptions::paper() : IicvOptions();
      options.std_error = true;
      const EstimatorResult fast = iicv(c.crn.view(), c.independent.view(), options);
      const Expected exact = reference_result(c.crn.view(), c.independent.view(),
                                              paper ? reference::Settings{true, true, 0, kSmallestPenalty}
                                                    : reference::Settings{true, true, 0, kSmallestPenalty, 30, 0.5});
      for (int y = 0; y < kHeight; ++y)
        for (int x = 0; x < kWidth; ++x) {
          const Rgb noise = reference::variance_of_mean(c.crn.view(), x, y);
          for (int i = 0; i < 3; ++i) {
            const size_t p = static_cast<size_t>(y) * kWidth + x;
            ASSERT_NEAR(fast.estimate.pixel(x, y)[i], exact.estimate[p][i], 5e-3 * std::sqrt(noise[i]));
            ASSERT_NEAR(fast.std_error.pixel(x, y)[i], exact.std_error[p][i], 5e-3 * std::sqrt(noise[i]));
          }
        }
    }
  }
}

// Parts of an image whose counts differ only elsewhere must have the bits of the whole.
TEST(UnequalCounts, APartWithEqualCountsGivesTheBitsOfTheWhole) {
  test::Grouped crn = test::crn_image(40, 260, 6, 1), independent = test::independent_image(40, 260, 6, 2);
  independent.counts.assign(static_cast<size_t>(40) * 260, 12);
  for (size_t i = 40 * 200; i < independent.counts.size(); ++i) independent.counts[i] = 31;
  GroupedImage whole = independent.view();
  whole.mean_count = (200.0 * 12 + 60 * 31) / 260;
  GroupedImage top = whole, crn_top = crn.view();
  top.height = crn_top.height = 160;
  const EstimatorResult all = iicv(crn.view(), whole), part = iicv(crn_top, top);
  const int rows = (160 - iicv_halo({})) / 4 * 4;
  ASSERT_GT(rows, 16);
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < 40; ++x)
      for (int c = 0; c < 3; ++c) ASSERT_EQ(all.estimate.pixel(x, y)[c], part.estimate.pixel(x, y)[c]) << y;
}

// Group means of samples with variance 1/12: the squared standard error must be (1/12) / N on average, for the mean
// estimator and for the moments used by the others. Over 40,000 pixels with T - 1 degrees of freedom each, the average
// has a relative standard deviation of at most sqrt(2 / 40000) = 0.007; six of them are allowed. Without weights it is
// too large by up to 12.5 % (sizes 1 and 2, half of each).
TEST(UnequalCounts, VariancesOfMeansAreUnbiased) {
  constexpr int kSide = 200;
  for (const auto& [groups, count] : {std::pair{2, 3u}, {8, 12u}, {12, 13u}, {12, 23u}}) {
    test::Grouped image = test::constant_image(kSide, kSide, groups, 0);
    image.counts.assign(static_cast<size_t>(kSide) * kSide, count);
    for (int p = 0; p < kSide * kSide; ++p)
      for (int t = 0; t < groups; ++t) {
        const uint32_t n = group_size(count, groups, t);
        float* value = image.pixel(p % kSide, p / kSide) + static_cast<ptrdiff_t>(3) * t;
        for (uint32_t s = 0; s < n; ++s) value[0] += test::noise(5, p, s * groups + t) / static_cast<float>(n);
      }
    const EstimatorResult mean = mean_of_groups(image.view());
    const std::vector<unsigned char> valid(static_cast<size_t>(kSide) * kSide, 1);
    const Moments m = moments(image.view(), valid, 0, 0);
    double by_mean = 0, by_moments = 0;
    for (int p = 0; p < kSide * kSide; ++p) {
      const int x = p % kSide, y = p / kSide;
      by_mean += std::pow(mean.std_error.pixel(x, y)[0], 2);
      by_moments += m.variance_of_mean.row(0, y)[x];
      ASSERT_NEAR(m.mean.row(0, y)[x], mean.estimate.pixel(x, y)[0], 1e-6);
    }
    const double expected = static_cast<double>(kSide) * kSide / 12 / count;
    EXPECT_NEAR(by_mean / expected, 1, 0.042) << groups << " groups of " << count;
    EXPECT_NEAR(by_moments / expected, 1, 0.042) << groups << " groups of " << count;
  }
}

TEST(UnequalCounts, MeansDoWithFewerSamplesThanGroups) {
  test::Grouped image = test::constant_image(4, 1, 3, 0);
  image.counts = {0, 1, 2, 5};
  for (int x = 0; x < 4; ++x)
    for (int t = 0; t < 3; ++t) image.pixel(x, 0)[3 * t] = static_cast<float>(1 + t);
  const EstimatorResult result = mean_of_groups(image.view());
  EXPECT_EQ(result.estimate.pixel(0, 0)[0], 0);
  EXPECT_EQ(result.estimate.pixel(1, 0)[0], 1);
  EXPECT_EQ(result.estimate.pixel(2, 0)[0], 1.5f);
  EXPECT_EQ(result.estimate.pixel(3, 0)[0], (2 * 1 + 2 * 2 + 3) / 5.0f);
  EXPECT_EQ(result.std_error.pixel(0, 0)[0], std::numeric_limits<float>::infinity());
  EXPECT_EQ(result.std_error.pixel(1, 0)[0], std::numeric_limits<float>::infinity());
  EXPECT_EQ(result.std_error.pixel(2, 0)[0], 0.5f);
  EXPECT_NEAR(result.std_error.pixel(3, 0)[0], std::sqrt((2 * 0.64 + 2 * 0.04 + 1.44) / (2 * 5)), 1e-6);
}

TEST(UnequalCounts, PairsRefuseGroupsWithoutSamples) {
  test::Grouped crn = with_counts(crn_image(), 12), independent = with_counts(independent_image(), 12);
  independent.counts[kWidth + 7] = 11;
  const std::string expected = "pixel (7, 1) of the independent image has 11 samples, fewer than the 12 groups";
  EXPECT_TRUE(contains(message_of([&] { iicv(crn.view(), independent.view()); }, ErrorCode::kUsage), expected));
  EXPECT_TRUE(contains(message_of([&] { cv_baseline(crn.view(), independent.view()); }), expected));
  IduwOptions options;
  options.samples = 12;
  EXPECT_TRUE(contains(message_of([&] { iduw(crn.view(), independent.view(), options); }), expected));
  EXPECT_TRUE(contains(message_of([&] { examine_inputs(crn.view(), independent.view()); }), expected));
  independent.counts[kWidth + 7] = 12;
  crn.counts[0] = 1;
  EXPECT_TRUE(contains(message_of([&] { iicv(crn.view(), independent.view()); }),
                       "pixel (0, 0) of the CRN image has 1 sample, fewer than the 12 groups"));
}

}  // namespace
}  // namespace covary
