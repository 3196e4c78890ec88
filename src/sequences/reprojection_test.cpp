// SPDX-License-Identifier: Apache-2.0
// Pictures moved by known amounts, and pixels that must not be taken from the previous frame.
#include "sequences/reprojection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "core/error.h"
#include "sequences/feature_slopes.h"

namespace covary {
namespace {

constexpr int kWidth = 24, kHeight = 16;

Image image_of(int channels, const std::function<float(int x, int y, int c)>& value) {
  Image image(kWidth, kHeight, channels);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < channels; ++c) image.pixel(x, y)[c] = value(x, y, c);
  return image;
}

Image constant(float value) {
  return image_of(1, [=](int, int, int) { return value; });
}

/// A wall at distance 5 that moves rigidly.
MotionLayers moving(float dx, float dy, float dz = 0) {
  return {constant(5), image_of(3, [=](int, int, int c) { return c == 0 ? dx : c == 1 ? dy : dz; })};
}

Image waves(float dx, float dy) {
  return image_of(3,
                  [=](int x, int y, int c) { return 2 + std::sin(0.5f * (x + dx) + c) + std::cos(0.4f * (y + dy)); });
}

bool is_known(const History& history, int x, int y) { return history.known[static_cast<size_t>(y) * kWidth + x] == 1; }

TEST(Reprojection, TakesPicturesAtRestAsTheyAre) {
  const Image before = waves(0, 0);
  const History history = reproject(before, constant(5), moving(0, 0));
  EXPECT_EQ(history.image.data, before.data);
  for (const float d : history.squared_error.data) EXPECT_EQ(d, 0);
  for (const unsigned char known : history.known) EXPECT_EQ(known, 1);
}

TEST(Reprojection, MovesByWholeAndPartsOfPixels) {
  for (const auto& [dx, dy] : {std::pair{3.0f, -2.0f}, std::pair{0.5f, 0.25f}, std::pair{-1.7f, 2.3f}}) {
    const History history = reproject(waves(0, 0), constant(5), moving(dx, dy));
    const Image expected = waves(dx, dy);
    int n = 0;
    for (int y = 4; y < kHeight - 4; ++y)
      for (int x = 4; x < kWidth - 4; ++x) {
        ASSERT_TRUE(is_known(history, x, y));
        for (int c = 0; c < 3; ++c) {
          const float error = std::abs(history.image.pixel(x, y)[c] - expected.pixel(x, y)[c]);
          // Linear interpolation is off by up to 0.05; at crests the value is clamped to the nearest pixels.
          EXPECT_LT(error, 0.05f);
          n += error < 0.01f;
        }
      }
    EXPECT_GT(n, 0.75 * 3 * (kWidth - 8) * (kHeight - 8));
  }
}

TEST(Reprojection, TellsHowFarInterpolationsDiffer) {
  const History smooth = reproject(waves(0, 0), constant(5), moving(0.5f, 0));
  const Image edge = image_of(3, [](int x, int, int) { return x < 12 ? 0.0f : 1.0f; });
  const History sharp = reproject(edge, constant(5), moving(0.3f, 0));
  EXPECT_LT(*smooth.squared_error.pixel(5, 5), 1e-3f);
  EXPECT_GT(*sharp.squared_error.pixel(11, 5), 1e-3f);
  EXPECT_EQ(*sharp.squared_error.pixel(3, 5), 0);
}

TEST(Reprojection, LeavesOutWhatWasOutOfTheFrame) {
  const History history = reproject(waves(0, 0), constant(5), moving(4, 0));
  EXPECT_TRUE(is_known(history, kWidth - 6, 5));
  EXPECT_FALSE(is_known(history, kWidth - 4, 5));
  const History gone = reproject(waves(0, 0), constant(5), moving(kWidth, 0));
  for (const unsigned char known : gone.known) EXPECT_EQ(known, 0);
}

TEST(Reprojection, LeavesOutWhatWasHidden) {
  // In the previous frame, something at distance 2 occluded the right half.
  const Image depth_before = image_of(1, [](int x, int, int) { return x < 12 ? 5.0f : 2.0f; });
  const History history = reproject(waves(0, 0), depth_before, moving(0, 0));
  EXPECT_TRUE(is_known(history, 11, 5));
  EXPECT_FALSE(is_known(history, 12, 5));
  // The wall came nearer: the motion gives its old depth.
  const History nearer = reproject(waves(0, 0), constant(7), moving(1, 0, 2));
  EXPECT_TRUE(is_known(nearer, 5, 5));
  const History other = reproject(waves(0, 0), constant(7), moving(1, 0, 1));
  EXPECT_FALSE(is_known(other, 5, 5));
  const History sky = reproject(waves(0, 0), constant(0), {constant(0), moving(1, 0).motion});
  EXPECT_TRUE(is_known(sky, 5, 5)) << "behind the scene there is no depth";
}

TEST(Reprojection, TakesSlantedSurfaces) {
  const auto slanted = [](float shift) {
    return image_of(1, [=](int x, int, int) { return 5 + 0.4f * (static_cast<float>(x) + shift); });
  };
  const History history = reproject(waves(0, 0), slanted(0), {slanted(0.5f), moving(0.5f, 0).motion});
  EXPECT_TRUE(is_known(history, 5, 5));
}

TEST(Reprojection, TellsEdgesOfWhatMovesOtherwise) {
  MotionLayers now = moving(1, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 12; x < kWidth; ++x) now.motion.pixel(x, y)[0] = 2;
  const Image steps = image_of(3, [](int x, int, int) { return static_cast<float>(x); });
  const History history = reproject(steps, constant(5), now);
  for (const int x : {11, 12}) {
    EXPECT_TRUE(is_known(history, x, 5));
    EXPECT_NEAR(*history.squared_error.pixel(x, 5), 0.2f, 1e-3) << "a fifth of the square of the difference, 1";
  }
  for (const int x : {10, 13}) EXPECT_NEAR(*history.squared_error.pixel(x, 5), 0, 1e-6);
}

TEST(Reprojection, MovesSamplesByWholePixelsAndWhatThePictureTells) {
  const Image zeros(kWidth, kHeight, 3);
  const Image noise = image_of(3, [](int x, int y, int c) { return static_cast<float>((7 * x + 5 * y + 3 * c) % 11); });
  const History history = reproject(waves(0, 0), constant(5), moving(-1.7f, 2.3f), {zeros, noise});
  for (int y = 4; y < kHeight - 4; ++y)
    for (int x = 4; x < kWidth - 4; ++x)
      for (int c = 0; c < 3; ++c) {
        const float within = history.image.pixel(x, y)[c] - waves(0, 0).pixel(x - 2, y + 2)[c];
        EXPECT_NEAR(history.samples[0].pixel(x, y)[c], within, 1e-5f);
        EXPECT_NEAR(history.samples[1].pixel(x, y)[c], noise.pixel(x - 2, y + 2)[c] + within, 1e-5f);
      }
  const History rests = reproject(waves(0, 0), constant(5), moving(0, 0), {zeros, noise});
  EXPECT_EQ(rests.samples[1].data, noise.data);
}

/// Shades with edges within pixels, moved by half a pixel: interpolation blurs them, but albedo locates them.
TEST(Reprojection, FollowsFeaturesWithinAPixel) {
  const auto albedo = [](float shift) {
    return image_of(3, [=](int x, int y, int) {
      const float at = (static_cast<float>(x) + shift) / 3;
      const float part = std::clamp(3 * (at - std::floor(at)), 0.0f, 1.0f);  // box-filtered coverage
      const auto shade = [&](float column) {
        return 0.5f + 0.05f * std::fmod(column + 4 + static_cast<float>(y / 3), 4.0f);
      };
      return (1 - part) * shade(std::floor(at) - 1) + part * shade(std::floor(at));
    });
  };
  const auto picture = [&](float shift) {
    Image image = albedo(shift);
    for (float& value : image.data) value *= 5;
    return image;
  };
  const Image normal(kWidth, kHeight, 3);
  const Image features = history_features(albedo(0.5f), normal);
  const auto largest_error = [&](const History& history, const Image& image) {
    float most = 0;
    for (int y = 4; y < kHeight - 4; ++y)
      for (int x = 4; x < kWidth - 4; ++x)
        most = std::max(most, std::abs(image.pixel(x, y)[1] - picture(1).pixel(x, y)[1]));
    EXPECT_TRUE(is_known(history, 8, 8));
    return most;
  };
  const std::array<Image, 2> samples = {picture(0.5f), picture(0.5f)};
  History history = reproject(picture(0.5f), constant(5), moving(0.5f, 0), samples, features);
  const History plain = reproject(picture(0.5f), constant(5), moving(0.5f, 0));
  for (int x = 6; x < 12; ++x)
    EXPECT_LE(*history.squared_error.pixel(x, 8), 0.05f * *plain.squared_error.pixel(x, 8) + 1e-6f);
  EXPECT_GT(largest_error(history, history.image), 0.05f);
  follow_features(history, albedo(1), normal);
  EXPECT_LT(largest_error(history, history.image), 0.02f);
  EXPECT_LT(largest_error(history, history.samples[1]), 0.02f);
  EXPECT_THROW(follow_features(history, Image(3, 2, 3), normal), Error);
}

TEST(Reprojection, NeedsFramesOfOneSize) { EXPECT_THROW(reproject(Image(3, 2, 3), constant(5), moving(0, 0)), Error); }

}  // namespace
}  // namespace covary
