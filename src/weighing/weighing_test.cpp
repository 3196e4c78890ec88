// SPDX-License-Identifier: Apache-2.0
#include "weighing/weighing.h"

#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace covary::weighing_test {
namespace {

const std::vector<std::string> kFilters = {"regression", "sharp", "smooth", "demodulated"};

/// An image without a pattern that repeats.
Image image_of(int width, int height, float seed, int first_row = 0) {
  Image image(width, height, 3);
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 3; ++c)
        image.pixel(x, y)[c] = 1 + 0.5f * std::sin(seed + 0.3f * static_cast<float>(x) +
                                                   0.41f * static_cast<float>((y + first_row) * (c + 1)));
  return image;
}

/// The images of rows first_row ….
struct Example {
  Image mean, std_error, albedo, normal;
  std::vector<Image> candidates;
  Example(int width, int height, int first_row = 0)
      : mean(image_of(width, height, 1, first_row)),
        std_error(image_of(width, height, 2, first_row)),
        albedo(image_of(width, height, 3, first_row)),
        normal(image_of(width, height, 4, first_row)) {
    for (const float seed : {1.1f, 1.2f, 1.5f, 0.9f}) candidates.push_back(image_of(width, height, seed, first_row));
  }
  WeighingInput input() const { return {&mean, candidates, &std_error, {&albedo, &normal, &albedo, &normal}}; }
};

void scale(float factor, Image& image) {
  for (float& value : image.data) value *= factor;
}

TEST(Weighing, KnowsTheCandidatesOfTheDefault) {
  EXPECT_TRUE(WeighingNetwork::find(kFilters));
  EXPECT_FALSE(WeighingNetwork::find(std::vector<std::string>{"sharp", "smooth"}));
}

TEST(Weighing, SharesSumToOneAndMixImages) {
  const Example example(45, 31);
  const Planes shares = WeighingNetwork::find(kFilters)->shares(example.input());
  ASSERT_EQ(shares.count(), 5);
  const PixelShares pixels(shares);
  const Image result = weighed(example.input(), shares);
  for (int y = 0; y < 31; ++y)
    for (int x = 0; x < 45; ++x) {
      float sum = 0, value = 0;
      for (int k = 0; k < 5; ++k) {
        const float share = pixels.at(k, x, y);
        ASSERT_GT(share, 0);
        sum += share;
        value += share * (k == 0 ? example.mean : example.candidates[static_cast<size_t>(k) - 1]).pixel(x, y)[1];
      }
      ASSERT_NEAR(sum, 1, 1e-5);
      ASSERT_NEAR(result.pixel(x, y)[1], value, 1e-5);
    }
}

/// Of 640 x 2 cells and 3 shares: those between two cells are a quarter of the way to the other.
TEST(Weighing, InterpolatesBetweenCells) {
  Planes shares(4, 2, 1, 1, 0);
  shares.row(0, 0)[0] = 1, shares.row(0, 1)[1] = 2;
  const PixelShares pixels(shares);
  EXPECT_FLOAT_EQ(pixels.at(0, 0, 0), 1);
  EXPECT_FLOAT_EQ(pixels.at(0, 1, 0), 0.75f);
  EXPECT_FLOAT_EQ(pixels.at(0, 1, 1), 0.75f * 0.75f + 0.25f * 0.25f * 2);
  EXPECT_FLOAT_EQ(pixels.at(0, 2, 3), 0.75f * 2);
}

TEST(Weighing, DependsOnDifferencesAndNotOnExposure) {
  Example example(40, 32);
  const WeighingNetwork& network = *WeighingNetwork::find(kFilters);
  const Planes before = network.shares(example.input());
  for (Image* image : {&example.mean, &example.std_error}) scale(1024, *image);
  for (Image& image : example.candidates) scale(1024, image);
  const Planes scaled = network.shares(example.input());
  for (int k = 0; k < 5; ++k) EXPECT_NEAR(scaled.row(k, 7)[9], before.row(k, 7)[9], 1e-5) << k;
}

TEST(Weighing, DoesNotDependOnThreads) {
  const Example example(131, 77);
  const auto shares = [&](size_t threads) {
    const tbb::global_control limit(tbb::global_control::max_allowed_parallelism, threads);
    return weighed(example.input(), WeighingNetwork::find(kFilters)->shares(example.input())).data;
  };
  EXPECT_EQ(shares(1), shares(4));
}

TEST(Weighing, OfRowsHasTheBitsOfTheWhole) {
  constexpr int kFirst = 40, kRows = 150;
  const Example whole(50, 240), rows(50, kRows, kFirst);
  static_assert(kFirst % kWeighingRows == 0);
  const WeighingNetwork& network = *WeighingNetwork::find(kFilters);
  const Image all = weighed(whole.input(), network.shares(whole.input()));
  const Image part = weighed(rows.input(), network.shares(rows.input()));
  for (int y = kWeighingHalo; y < kRows - kWeighingHalo; ++y)
    for (int x = 0; x < 50; ++x) ASSERT_EQ(part.pixel(x, y)[0], all.pixel(x, y + kFirst)[0]) << x << ", " << y;
}

TEST(Weighing, TakesBlackAndHugeImages) {
  for (const float factor : {0.0f, 1e15f}) {
    Example example(24, 16);
    for (Image& image : example.candidates) scale(factor, image);
    const Planes shares = WeighingNetwork::find(kFilters)->shares(example.input());
    for (int k = 0; k < 5; ++k) EXPECT_TRUE(std::isfinite(shares.row(k, 3)[5])) << factor;
  }
}

}  // namespace
}  // namespace covary::weighing_test
