// SPDX-License-Identifier: Apache-2.0
#include "denoising/mirrored_halves.h"

#include <gtest/gtest.h>

#include <array>

namespace covary::mirrored_halves_test {
namespace {

constexpr int kWidth = 5, kHeight = 3;

Image constant(float value) {
  Image image(kWidth, kHeight, 3);
  for (float& v : image.data) v = value;
  return image;
}

/// A denoiser with an error of 4 in the first column and of 8 in the first row of the image it is given.
Image wrong_at_the_edges(Image result, Mirror, int) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) result.pixel(x, y)[c] += (x == 0 ? 4.0f : 0.0f) + (y == 0 ? 8.0f : 0.0f);
  return result;
}

TEST(MirroredHalves, TurnsPixelsOver) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] = static_cast<float>(100 * y + 10 * x + c);
  EXPECT_EQ(mirrored(image, Mirror::kColumns).pixel(1, 2)[0], 230);
  EXPECT_EQ(mirrored(image, Mirror::kRows).pixel(1, 2)[2], 12);
  EXPECT_EQ(mirrored(image, Mirror::kNone).data, image.data);
}

TEST(MirroredHalves, SpreadWhatTheDenoiserErrsOverPlaces) {
  std::array<Image, 3> results = {constant(2), constant(1), constant(3)};
  denoise_with_halves(results, wrong_at_the_edges);
  EXPECT_EQ(results[1].pixel(kWidth - 1, 1)[0], 1 + 4) << "columns of the first half are in reverse order";
  EXPECT_EQ(results[1].pixel(1, 0)[0], 1 + 8);
  EXPECT_EQ(results[2].pixel(0, 1)[0], 3 + 4);
  EXPECT_EQ(results[2].pixel(1, kHeight - 1)[0], 3 + 8) << "rows of the second half are";
  EXPECT_EQ(results[0].pixel(1, 1)[0], 2);
  EXPECT_EQ(results[0].pixel(0, 1)[0], 2 + 3) << "half and a quarter of 4";
  EXPECT_EQ(results[0].pixel(kWidth - 1, 1)[0], 2 + 1);
  EXPECT_EQ(results[0].pixel(1, 0)[0], 2 + 6);
  EXPECT_EQ(results[0].pixel(1, kHeight - 1)[0], 2 + 2);
}

TEST(MirroredHalves, LeavesASingleImageAsItIsDenoised) {
  const Image whole = constant(2);
  std::array<Image, 1> results = {whole};
  denoise_with_halves(results, wrong_at_the_edges);
  EXPECT_EQ(results[0].data, wrong_at_the_edges(whole, Mirror::kNone, 0).data);
}

}  // namespace
}  // namespace covary::mirrored_halves_test
