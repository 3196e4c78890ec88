// SPDX-License-Identifier: Apache-2.0
// The exposure of previews, from pictures of which it is plain.
#include "film/exposure.h"

#include <gtest/gtest.h>

#include <cmath>

namespace covary::exposure_test {
namespace {

Image grey(const std::vector<float>& values) {
  Image image(static_cast<int>(values.size()), 1, 3);
  for (size_t i = 0; i < 3 * values.size(); ++i) image.data[i] = values[i / 3];
  return image;
}

TEST(Exposure, LeavesGoodPicturesAlone) {
  std::vector<float> values(90, 0.5f);
  values.resize(100, 30);  // a tenth is burnt, not more
  EXPECT_EQ(exposure_for_display(grey(values)), 0);
  values.resize(5000, 0);  // black where no light is
  EXPECT_EQ(exposure_for_display(grey(values)), 0);
  EXPECT_EQ(exposure_for_display(grey(std::vector<float>(10, 1))), 0);  // white is not burnt
  EXPECT_EQ(exposure_for_display(grey(std::vector<float>(10, 0))), 0);
}

TEST(Exposure, BringsEverythingIntoTheRange) {
  // Bright: below 1, log2(1 / 200) = -7.64; dark: to 0.18, log2(0.18 / 1e-4) = 10.81; in half stops.
  EXPECT_EQ(exposure_for_display(grey(std::vector<float>(10, 200))), -8);
  EXPECT_EQ(exposure_for_display(grey({0.9f, 0.95f, 1.02f, 0.97f, 1.1f, 0.98f})), -0.5);  // noise around white
  EXPECT_EQ(exposure_for_display(grey(std::vector<float>(10, 1e-4f))), 11);
  // From 1 to 512: with -8 stops all but 512, a tenth, are at most 1.
  std::vector<float> range;
  for (int i = 0; i < 10; ++i) range.push_back(std::exp2(static_cast<float>(i)));
  EXPECT_EQ(exposure_for_display(grey(range)), -8);
  // More than the range: the few bright ones are given up.
  std::vector<float> lamps(60, 2.0f);
  lamps.resize(70, 1e6f);
  const double stops = exposure_for_display(grey(lamps));
  EXPECT_LT(2 * std::exp2(stops), 1.001);
  EXPECT_GT(2 * std::exp2(stops), 0.0015);
}

/// A dark room with a window, and a model with a lamp: they stay visible.
TEST(Exposure, DoesNotDarkenPicturesForTheirLamps) {
  std::vector<float> values(80, 0.2f);
  values.resize(100, 50);
  EXPECT_EQ(exposure_for_display(grey(values)), 0);
  for (size_t i = 80; i < 90; ++i) values[i] = 1.3f;  // which half a stop brings back
  EXPECT_EQ(exposure_for_display(grey(values)), -0.5);
}

TEST(Exposure, NumbersThatAreNoneAreLeftOut) {
  std::vector<float> values(10, 8);
  values.push_back(NAN), values.push_back(INFINITY);
  EXPECT_EQ(exposure_for_display(grey(values)), -3);  // 8 becomes 1
}

TEST(Exposure, ExposedIsAFactor) { EXPECT_EQ(exposed(grey({0.5f, 3}), -2).data[3], 0.75f); }

}  // namespace
}  // namespace covary::exposure_test
