// SPDX-License-Identifier: Apache-2.0
#include "sequences/feature_slopes.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace covary {
namespace {

constexpr int kSide = 9;

/// Independent features, and a picture that depends on the first and the fifth.
void fill(Image& features, Image& picture) {
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x) {
      float* const f = features.pixel(x, y);
      for (int i = 0; i < kHistoryFeatures; ++i) f[i] = std::sin(static_cast<float>((3 * i + 1) * x + (i * i + 2) * y));
      for (int c = 0; c < 3; ++c) picture.pixel(x, y)[c] = 5 + static_cast<float>(c + 1) * f[0] - 2 * f[4];
    }
}

TEST(FeatureSlopes, AreThoseOfThePicture) {
  Image features(kSide, kSide, kHistoryFeatures), picture(kSide, kSide, 3);
  fill(features, picture);
  for (const int x : {0, 4, 8}) {
    const FeatureSlopes slopes = feature_slopes(picture, features, x, 4);
    for (size_t i = 0; i < kHistoryFeatures; ++i)
      for (size_t c = 0; c < 3; ++c)
        EXPECT_NEAR(slopes[3 * i + c], i == 0 ? static_cast<float>(c + 1) : i == 4 ? -2.0f : 0, 0.05f);
  }
}

TEST(FeatureSlopes, OfOneSurfaceAreZero) {
  Image features(kSide, kSide, kHistoryFeatures), picture(kSide, kSide, 3);
  fill(features, picture);
  std::fill(features.data.begin(), features.data.end(), 0.4f);
  for (const float slope : feature_slopes(picture, features, 4, 4)) EXPECT_NEAR(slope, 0, 1e-4f);
}

TEST(FeatureSlopes, LeaveOutPixelsThatAreNotFinite) {
  Image features(kSide, kSide, kHistoryFeatures), picture(kSide, kSide, 3);
  fill(features, picture);
  picture.pixel(3, 4)[1] = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NEAR(feature_slopes(picture, features, 4, 4)[1], 2, 0.05f);
}

TEST(FeatureSlopes, NeedBothFeatures) {
  EXPECT_TRUE(history_features(Image(), Image(2, 1, 3)).data.empty());
  Image albedo(2, 1, 3), normal(2, 1, 3);
  albedo.pixel(1, 0)[2] = 0.3f, normal.pixel(1, 0)[0] = -1;
  const Image both = history_features(albedo, normal);
  EXPECT_EQ(both.pixel(1, 0)[2], 0.3f);
  EXPECT_EQ(both.pixel(1, 0)[3], -1);
}

}  // namespace
}  // namespace covary
