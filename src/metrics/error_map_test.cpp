// SPDX-License-Identifier: Apache-2.0
#include "metrics/error_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "film/image_file.h"

namespace covary {
namespace {

Image map_of(std::vector<float> values) {
  Image map(static_cast<int>(values.size()), 1, 1);
  map.data = std::move(values);
  return map;
}

/// Lightness L* of linear RGB.
double lightness(const Spectrum& c) {
  const double y = 0.2126 * c.r + 0.7152 * c.g + 0.0722 * c.b;
  return y > 0.008856 ? 116 * std::cbrt(y) - 16 : 903.3 * y;
}

TEST(ErrorMap, LightnessRisesEvenly) {
  std::vector<float> values;
  for (int i = 0; i <= 64; ++i) values.push_back(static_cast<float>(i) / 64);
  const Image image = colour_errors(map_of(values), {0, 1, false});
  for (int i = 1; i <= 64; ++i) {
    const double step = lightness(image.rgb(i, 0)) - lightness(image.rgb(i - 1, 0));
    EXPECT_GT(step, 0.2) << i;
    EXPECT_LT(step, 2.8) << i;
  }
}

TEST(ErrorMap, ScalesAndLegends) {
  const ErrorScale scale = decade_scale(std::vector{map_of({0, -1, 0.002f, 0.5f, NAN}), map_of({0.03f, 0.04f})});
  EXPECT_TRUE(scale.logarithmic);
  EXPECT_NEAR(scale.low, 1e-3, 1e-12);
  EXPECT_NEAR(scale.high, 1, 1e-12);
  EXPECT_EQ(scale.legend(), "0.001 black, 0.00562 violet, 0.0316 red, 0.178 orange, 1 pale yellow (logarithmic)");
  EXPECT_EQ((ErrorScale{0, 1, false}.legend()), "0 black, 0.25 violet, 0.5 red, 0.75 orange, 1 pale yellow (linear)");
  EXPECT_LT(decade_scale(std::vector{map_of({0, 0})}).low, decade_scale(std::vector{map_of({0, 0})}).high);
}

TEST(ErrorMap, EndsAndNotANumber) {
  const ErrorScale scale{1e-3, 1, true};
  const Image image =
      colour_errors(map_of({-1, 0, 5e-4f, 1, 1e9f, std::numeric_limits<float>::infinity(), NAN}), scale);
  EXPECT_EQ(image.rgb(0, 0), image.rgb(2, 0));
  EXPECT_EQ(image.rgb(1, 0), image.rgb(2, 0));
  EXPECT_EQ(image.rgb(4, 0), image.rgb(3, 0));
  EXPECT_EQ(image.rgb(5, 0), image.rgb(3, 0));
  EXPECT_EQ(image.rgb(6, 0), Spectrum(0, 1, 0));
}

}  // namespace
}  // namespace covary
