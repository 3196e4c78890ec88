// SPDX-License-Identifier: Apache-2.0
// FLIP against values of the authors' own program (flip-evaluator 1.7) on images given by formulas.
#include "metrics/flip.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace covary {
namespace {

constexpr int kWidth = 64, kHeight = 48;

/// Waves of three frequencies, perturbed by `amplitude`; `slope` scales brightness from 1 % to 600 % along x.
Image waves(double amplitude, double scale, double slope) {
  Image image(kWidth, kHeight, 3);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      const double clean[3] = {0.5 + 0.5 * std::sin(0.31 * x + 0.17 * y), 0.4 + 0.4 * std::cos(0.23 * x - 0.11 * y),
                               0.3 + 0.3 * std::sin(0.05 * x * y / 8)};
      const double noise[3] = {std::sin(2.1 * x + 0.7 * y), std::sin(1.3 * x - 1.9 * y), std::cos(0.9 * x + 2.3 * y)};
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = static_cast<float>(std::max(clean[c] * (1 + amplitude * noise[c]), 0.0) * scale *
                                                  std::exp(slope * (x - 32)));
    }
  return image;
}

double mean_of(const Image& map) {
  double sum = 0;
  for (float v : map.data) sum += v;
  return sum / static_cast<double>(map.data.size());
}

// flip-evaluator computes in float with other powers and exponentials: agreement to 2e-5 of values below 0.3.
constexpr double kTolerance = 2e-5;

TEST(Flip, LowDynamicRangeAgreesWithItsAuthors) {
  const Image map = flip_ldr(waves(0.4, 1, 0), waves(0, 1, 0));
  EXPECT_NEAR(mean_of(map), 0.11694005131721497, kTolerance);
  EXPECT_NEAR(*map.pixel(0, 0), 0.24755655229091644, kTolerance);
  EXPECT_NEAR(*map.pixel(20, 30), 0.042607445269823074, kTolerance);
  EXPECT_NEAR(*map.pixel(63, 47), 0.17202946543693542, kTolerance);
  // A viewing distance that is off by 1 % is rejected.
  EXPECT_GT(std::abs(mean_of(flip_ldr(waves(0.4, 1, 0), waves(0, 1, 0), 1.01f * kFlipPixelsPerDegree)) - 0.11694005),
            10 * kTolerance);
}

TEST(Flip, HighDynamicRangeAgreesWithItsAuthors) {
  const Image reference = waves(0, 4, 0.1);
  const FlipExposures exposures = flip_exposures(reference);
  EXPECT_NEAR(exposures.start, -4.817420959472656, 1e-5);
  EXPECT_NEAR(exposures.stop, 0.7730486392974854, 1e-5);
  EXPECT_EQ(exposures.count, 6);
  const Image map = flip_hdr(waves(0.4, 4, 0.1), reference);
  EXPECT_NEAR(mean_of(map), 0.09729405492544174, kTolerance);
  EXPECT_NEAR(*map.pixel(0, 0), 0.14110074937343597, kTolerance);
  EXPECT_NEAR(*map.pixel(20, 30), 0.1110340803861618, kTolerance);
  EXPECT_NEAR(*map.pixel(63, 47), 0.30344802141189575, kTolerance);
}

TEST(Flip, OfAnImageWithItselfIsZero) {
  for (const Image& map : {flip_ldr(waves(0.4, 1, 0), waves(0.4, 1, 0)), flip_hdr(waves(0, 4, 0.1), waves(0, 4, 0.1))})
    for (float v : map.data) ASSERT_EQ(v, 0);
}

// Green and blue are the sRGB colours that differ most in this metric; their error is one.
TEST(Flip, LargestDifferenceIsOne) {
  Image green(40, 40, 3), blue(40, 40, 3);
  for (size_t p = 0; p < 1600; ++p) green.data[p * 3 + 1] = blue.data[p * 3 + 2] = 1;
  EXPECT_NEAR(mean_of(flip_ldr(green, blue)), 1, 1e-4);
}

TEST(Flip, BlackReferenceIsFinite) {
  const Image black(8, 8, 3);
  EXPECT_EQ(mean_of(flip_hdr(black, black)), 0);
  for (float v : flip_hdr(waves(0, 1, 0), Image(kWidth, kHeight, 3)).data) ASSERT_TRUE(v >= 0 && v <= 1);
}

// The tone curve saturates at 1 and must not overflow before.
TEST(Flip, HugeValuesAreWhite) {
  Image white(8, 8, 3), huge(8, 8, 3);
  const Image black(8, 8, 3);
  for (const float value : {1e18f, 1e20f, 1e38f, std::numeric_limits<float>::max()}) {
    std::fill(white.data.begin(), white.data.end(), 1e6f);
    std::fill(huge.data.begin(), huge.data.end(), value);
    const double expected = mean_of(flip_hdr(white, black));
    EXPECT_GT(expected, 0.5);
    EXPECT_NEAR(mean_of(flip_hdr(huge, black)), expected, 1e-6) << value;
    EXPECT_GT(mean_of(flip_hdr(black, huge)), 0.5) << value;
    EXPECT_EQ(mean_of(flip_hdr(huge, huge)), 0) << value;
  }
}

}  // namespace
}  // namespace covary
