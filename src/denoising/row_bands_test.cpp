// SPDX-License-Identifier: Apache-2.0
#include "denoising/row_bands.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

namespace covary {
namespace {

TEST(RowBands, CoverTheRowsOnceWithTheirReach) {
  constexpr int kHeight = 700, kHalo = 50;
  for (const int at_once : {10, 130, 200, 333}) {
    int next = 100;
    for (const RowBand& band : bands_of(kHeight, at_once, kHalo, 100, 650)) {
      EXPECT_EQ(band.y, next);
      EXPECT_EQ(band.first + band.skipped, band.y);
      EXPECT_EQ(band.first % kBandCell, 0);
      EXPECT_LE(band.first, std::max(0, band.y - kHalo));
      EXPECT_GE(band.first + band.rows, std::min(kHeight, band.y + band.n + kHalo));
      EXPECT_LE(band.first + band.rows, kHeight);
      EXPECT_LE(band.rows, std::max(at_once, 2 * kHalo + 2 * kBandCell)) << at_once;
      next += band.n;
    }
    EXPECT_EQ(next, 650);
  }
}

TEST(RowBands, HoldRowsOfFeatures) {
  Image albedo(2, 9, 3);
  for (int y = 0; y < 9; ++y) albedo.pixel(1, y)[2] = static_cast<float>(y);
  Features whole;
  whole.albedo = &albedo;
  whole.clean = true;
  FeatureDifferences differences;
  for (size_t i = 0; i < albedo.data.size(); ++i)
    differences.values[feature::kAlbedo].push_back(upper_half(static_cast<float>(i)));
  whole.differences = &differences;
  const FeatureRows rows(whole, 4, 3);
  ASSERT_TRUE(rows.features.albedo);
  EXPECT_EQ(rows.features.albedo->height, 3);
  EXPECT_EQ(rows.features.albedo->pixel(1, 1)[2], 5);
  EXPECT_FALSE(rows.features.normal);
  EXPECT_TRUE(rows.features.clean);
  ASSERT_EQ(rows.differences.values[feature::kAlbedo].size(), size_t{18});
  EXPECT_EQ(from_upper_half(rows.features.differences->values[feature::kAlbedo][0]), 24);
}

}  // namespace
}  // namespace covary
