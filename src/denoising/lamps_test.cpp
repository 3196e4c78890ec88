// SPDX-License-Identifier: Apache-2.0
#include "denoising/lamps.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <limits>

namespace covary::lamps_test {
namespace {

constexpr int kWidth = 24, kHeight = 16;

/// A ceiling of 0.1 to 0.3 with a lamp of 10 in the columns 8 … 13 and rows 4 … 9, which covers half of column 14.
Image ceiling_with_lamp() {
  Image picture(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const bool is_row = y >= 4 && y < 10;
      const float value = is_row && x >= 8 && x < 14 ? 10.0f : is_row && x == 14 ? 5.0f : 0.1f + 0.1f * ((x + y) % 3);
      for (int c = 0; c < 3; ++c) picture.pixel(x, y)[c] = value;
    }
  return picture;
}

Image white() {
  Image albedo(kWidth, kHeight, 3);
  std::fill(albedo.data.begin(), albedo.data.end(), 0.8f);
  return albedo;
}

TEST(Lamps, AreBlackInTheAlbedoWithThePartsOfPixelsThatTheyCover) {
  Image albedo = white();
  darken_lamps(ceiling_with_lamp(), albedo);
  EXPECT_EQ(albedo.pixel(10, 6)[0], 0);
  EXPECT_EQ(albedo.pixel(8, 4)[2], 0) << "a corner";
  EXPECT_NEAR(albedo.pixel(14, 6)[1], 0.4f, 1e-6f) << "half a pixel";
  EXPECT_NEAR(albedo.pixel(7, 6)[1], 0.8f, 0.03f) << "the ceiling beside it";
  EXPECT_EQ(albedo.pixel(2, 6)[1], 0.8f);
}

TEST(Lamps, AreNeitherNoisyNorAsDarkAsTheRest) {
  Image noisy = ceiling_with_lamp();
  for (size_t i = 0; i < noisy.data.size(); ++i) noisy.data[i] *= 1 + 0.1f * std::sin(static_cast<float>(i / 3 * i));
  Image dim = ceiling_with_lamp();
  for (float& value : dim.data) value = std::min(value, 1.5f);
  Image broken = ceiling_with_lamp();
  for (float& value : broken.data) value = std::numeric_limits<float>::quiet_NaN();
  for (const Image& picture : {noisy, dim, broken, Image(kWidth, kHeight, 3), Image(3, 3, 3)}) {
    Image albedo = white();
    darken_lamps(picture, albedo);
    EXPECT_EQ(albedo.data, white().data);
  }
}

}  // namespace
}  // namespace covary::lamps_test
