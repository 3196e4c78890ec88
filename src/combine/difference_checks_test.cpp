// SPDX-License-Identifier: Apache-2.0
// The checks detect each planted fault of two renders, and none in good ones. Seeds are fixed. With 40,000 pixels, the
// fraction of brighter ones has standard deviation 0.0025, the correlation of signs 0.005.
#include "combine/difference_checks.h"

#include <gtest/gtest.h>

#include <string>

#include "estimators/test_images.h"

namespace covary::difference_checks_test {
namespace {

constexpr int kWidth = 250, kHeight = 160;

std::string findings(const test::Grouped& image) {
  DifferenceChecks checks(image.width, image.height, image.groups);
  for (int y = 0; y < kHeight; y += 40) checks.add_rows(rows_of(image.view(), y, 40));
  std::vector<Finding> found;
  checks.report({}, found);
  std::string text;
  for (const Finding& f : found) text += f.text + "\n";
  return text;
}

test::Grouped good(int groups) { return test::independent_image(kWidth, kHeight, groups, 3); }

/// Each render filtered by a mean over 15 pixels of a row, mixing neighbours as a denoiser does.
test::Grouped denoised(const test::Grouped& image) {
  constexpr int kHalo = 7;
  test::Grouped result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = kHalo; x + kHalo < image.width; ++x)
      for (int i = 0; i < 3 * image.groups; ++i) {
        float sum = 0;
        for (int dx = -kHalo; dx <= kHalo; ++dx) sum += image.view().pixel(x + dx, y)[i];
        result.pixel(x, y)[i] = sum / (2 * kHalo + 1);
      }
  return result;
}

test::Grouped brighter(const test::Grouped& image, float factor) {
  test::Grouped result = image;
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) result.pixel(x, y)[c] *= factor;
  return result;
}

TEST(DifferenceChecks, GoodRendersPass) {
  for (const int groups : {2, 3, 12}) EXPECT_EQ(findings(good(groups)), "") << groups;
}

TEST(DifferenceChecks, FindsDenoisedRenders) {
  EXPECT_NE(findings(denoised(good(2))).find("they were denoised before"), std::string::npos);
}

/// Each render filtered by the weights 1, 2, 1 in rows, as a tent does.
TEST(DifferenceChecks, WarnOfWideFilters) {
  const test::Grouped sharp = good(2);
  test::Grouped wide = sharp;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 1; x + 1 < kWidth; ++x)
      for (int i = 0; i < 6; ++i)
        wide.pixel(x, y)[i] = 0.5f * sharp.view().pixel(x, y)[i] +
                              0.25f * (sharp.view().pixel(x - 1, y)[i] + sharp.view().pixel(x + 1, y)[i]);
  const std::string text = findings(wide);
  EXPECT_NE(text.find("the pixel filter is wider than a pixel"), std::string::npos) << text;
}

TEST(DifferenceChecks, FindsPixelsThatShareRandomNumbers) {
  EXPECT_NE(findings(test::crn_image(kWidth, kHeight, 2, 1)).find("pixels share random numbers"), std::string::npos);
}

TEST(DifferenceChecks, FindsAnotherExposure) {
  EXPECT_EQ(findings(brighter(good(2), 1.0f)), "");
  const std::string text = findings(brighter(good(2), 1.3f));
  EXPECT_NE(text.find("exposure"), std::string::npos) << text;
}

TEST(DifferenceChecks, LooksAtEveryPairOfNeighbours) {
  test::Grouped image = good(4);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[9 + c] *= 1.5f;
  EXPECT_NE(findings(image).find("render 3 and render 4"), std::string::npos);
}

}  // namespace
}  // namespace covary::difference_checks_test
