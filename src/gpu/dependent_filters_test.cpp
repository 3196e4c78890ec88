// SPDX-License-Identifier: Apache-2.0
// The filters of dependent tests on a device, against dependent_tests/.
#include "gpu/dependent_filters.h"

#include <gtest/gtest.h>

#include "estimators/test_images.h"
#include "gpu/comparison.h"

namespace covary::gpu {
namespace {

using test_support::agree;
using test_support::test_device;

constexpr int kWidth = 53, kHeight = 38;

/// A dark and a bright half, classes of different numbers of samples, and a pixel that is left out.
FilterInput example() {
  test::Grouped crn = test::crn_image(kWidth, kHeight, 8, 3);
  test::Grouped independent = test::independent_image(kWidth, kHeight, 8, 4);
  for (int i = 0; i < kWidth * kHeight; ++i)
    independent.counts.push_back(i % kWidth < 30 ? 16 : 8 * (1 + static_cast<uint32_t>(i) % 3));
  std::vector<unsigned char> valid(size_t{kWidth} * kHeight, 1);
  valid[400] = 0;
  return filter_input(crn.view(), independent.view(), valid, VarianceSource::kBoth, 3, 31);
}

testing::AssertionResult same(const FilteredImage& expected, const FilteredImage& found) {
  const std::pair<const char*, Image FilteredImage::*> parts[] = {
      {"colour", &FilteredImage::colour},
      {"region", &FilteredImage::region},
      {"centre weight", &FilteredImage::centre_weight},
      {"bound", &FilteredImage::bound},
      {"effective samples", &FilteredImage::effective_samples}};
  for (const auto& [name, part] : parts)
    if (const testing::AssertionResult result = agree((expected.*part).data, (found.*part).data); !result)
      return testing::AssertionFailure() << name << ": " << result.message();
  return testing::AssertionSuccess();
}

TEST(GpuRegionFilter, IsThatOfTheProcessor) {
  FilterInput input = example();
  for (const Falloff falloff : {Falloff::kPyramid, Falloff::kCount, Falloff::kSpline, Falloff::kGaussian})
    for (const int side : {1, 4, 9}) {
      SCOPED_TRACE(fmt::format("falloff {}, side {}", static_cast<int>(falloff), side));
      const RegionOptions options{side, 0.01f, falloff};
      input.norm = side == 9 ? Norm::kEuclidean : Norm::kSum;
      EXPECT_TRUE(same(covary::region_filter(input, options), region_filter(test_device(), input, options)));
    }
}

TEST(GpuRegionFilter, NoticesABug) {
  const FilterInput input = example();
  const RegionOptions options;
  EXPECT_FALSE(same(covary::region_filter(input, options), region_filter(test_device(), input, options, true)));
}

TEST(GpuBoundFilter, IsThatOfTheProcessor) {
  const FilterInput input = example();
  Planes scale(kWidth, kHeight, 1, 31, 1);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) scale.row(0, y)[x] = x % 5 == 0 ? kFar : 0.3f * static_cast<float>(y % 4);
  for (const int window : {3, 11, 61})
    for (const Planes* scaled : {static_cast<const Planes*>(nullptr), static_cast<const Planes*>(&scale)}) {
      SCOPED_TRACE(fmt::format("window {}, {}", window, scaled ? "scaled" : "as they are"));
      EXPECT_TRUE(
          same(covary::bound_filter(input, window, scaled), bound_filter(test_device(), input, window, scaled)));
    }
}

TEST(GpuBoundFilter, NoticesABug) {
  const FilterInput input = example();
  EXPECT_FALSE(same(covary::bound_filter(input, 11), bound_filter(test_device(), input, 11, nullptr, true)));
}

TEST(GpuDependentTests, AreThoseOfTheProcessor) {
  const test::Grouped crn = test::crn_image(kWidth, kHeight, 8, 5),
                      independent = test::independent_image(kWidth, kHeight, 8, 6);
  for (const DependentTestsOptions& options : {DependentTestsOptions(), DependentTestsOptions::paper()}) {
    const EstimatorResult expected = covary::dependent_tests(crn.view(), independent.view(), options);
    const EstimatorResult found = gpu::dependent_tests(test_device(), crn.view(), independent.view(), options);
    EXPECT_TRUE(agree(expected.estimate.data, found.estimate.data));
    EXPECT_NE(expected.estimate.data, found.estimate.data);
  }
}

}  // namespace
}  // namespace covary::gpu
