// SPDX-License-Identifier: Apache-2.0
// Which values are stray follows from the brightness of the picture: here 40 x 30 pixels of 0.5, each counted with 0.1
// more, 720 in all; ten thousand times that is 7.2e6 of the mean over groups.
#include "filters/stray_values.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "estimators/test_images.h"
#include "filters/planes.h"

namespace covary::stray_values_test {
namespace {

constexpr int kWidth = 40, kHeight = 30;

std::vector<StrayValue> found(const test::Grouped& image) {
  StrayValues values;
  values.add_rows(rows_of(image.view(), 0, 11));
  values.add_rows(rows_of(image.view(), 11, kHeight - 11));
  return values.found();
}

test::Grouped flat(int groups) { return test::constant_image(kWidth, kHeight, groups, 0.5f); }

void set(test::Grouped& image, int x, int y, int group, float value) {
  std::fill_n(image.pixel(x, y) + 3 * group, 3, value);
}

TEST(StrayValues, OneValueOutshinesThePicture) {
  for (const float value : {3e8f, 1e9f, 1e12f, 1e15f}) {
    test::Grouped image = flat(2);
    set(image, 7, 20, 1, value);
    const std::vector<StrayValue> strays = found(image);
    ASSERT_EQ(strays.size(), 1u) << value;
    EXPECT_EQ(strays[0].x, 7);
    EXPECT_EQ(strays[0].y, 20);
    EXPECT_EQ(strays[0].group, 1);
    EXPECT_EQ(strays[0].brightness, value);
  }
  test::Grouped image = flat(2);  // 2 groups: 7.2e6 is the mean of 1.44e7 and 0
  set(image, 7, 20, 1, 1.4e7f);
  EXPECT_TRUE(found(image).empty());
  set(image, 7, 20, 1, 1.5e7f);
  EXPECT_EQ(found(image).size(), 1u);
}

TEST(StrayValues, OneDoesNotHideAnother) {
  test::Grouped image = flat(2);
  const float values[] = {1e14f, 1e9f, 1e9f, 2e8f, 1e5f};  // the last: a firefly
  for (int i = 0; i < 5; ++i) set(image, 3 * i, i, i % 2, values[i]);
  const std::vector<StrayValue> strays = found(image);
  ASSERT_EQ(strays.size(), 4u);
  EXPECT_EQ(strays[0].brightness, 1e14f);
  EXPECT_EQ(strays[3].brightness, 2e8f);
}

TEST(StrayValues, ConfirmedLightIsNone) {
  test::Grouped image = flat(3);
  set(image, 7, 20, 0, 1e9f), set(image, 7, 20, 2, 3e8f);
  EXPECT_TRUE(found(image).empty());
  image = flat(2);  // many: the picture is like that
  for (int i = 0; i < 100; ++i) set(image, i % kWidth, i / kWidth, 0, 1e9f);
  EXPECT_TRUE(found(image).empty());
  image = flat(1);  // a single group confirms nothing: a lamp may be that bright
  set(image, 7, 20, 0, 1e9f);
  EXPECT_TRUE(found(image).empty());
  // Rare light alone in a black picture, and a picture without any.
  image = test::constant_image(kWidth, kHeight, 8, 0);
  set(image, 3, 4, 5, 500);
  EXPECT_TRUE(found(image).empty());
  EXPECT_TRUE(found(test::constant_image(kWidth, kHeight, 2, 0)).empty());
}

TEST(StrayValues, UnusableValuesDoNotCount) {
  test::Grouped image = flat(2);
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
    image.pixel(1, 1)[0] = bad;
    EXPECT_TRUE(found(image).empty());
  }
  set(image, 7, 20, 1, 1e9f);
  EXPECT_EQ(found(image).size(), 1u);
  EXPECT_TRUE(is_usable(1e15f));
  for (const float bad : {1e16f, -1e19f, 3e38f, std::nanf("")}) EXPECT_FALSE(is_usable(bad)) << bad;
}

TEST(StrayValues, AreLeftOutOfTheirRows) {
  test::Grouped image = flat(2);
  leave_out({{7, 20, 1, 1e9f}, {3, 2, 0, 1e9f}}, 15, 10, kWidth, 2, image.pixel(0, 15));
  for (int i = 0; i < 6; ++i) EXPECT_EQ(std::isnan(image.pixel(7, 20)[i]), i >= 3);
  EXPECT_FALSE(std::isnan(image.pixel(3, 2)[0])) << "not among these rows";
}

TEST(StrayValues, NeighboursReplaceThem) {
  Image image(5, 5, 3);
  std::fill(image.data.begin(), image.data.end(), 2.0f);
  std::fill_n(image.pixel(1, 2), 3, 10.0f);
  image.pixel(2, 2)[1] = std::numeric_limits<float>::infinity();
  image.pixel(4, 4)[0] = 1e30f;
  std::vector<StrayValue> replaced;
  const Image result = with_usable_values(image, &replaced);
  ASSERT_EQ(replaced.size(), 2u);
  EXPECT_EQ(replaced[0].x, 2);
  EXPECT_EQ(replaced[1].y, 4);
  for (int c = 0; c < 3; ++c) {
    EXPECT_FLOAT_EQ(result.pixel(2, 2)[c], 3) << "(7 * 2 + 10) / 8";
    EXPECT_FLOAT_EQ(result.pixel(4, 4)[c], 2);
    EXPECT_EQ(result.pixel(1, 2)[c], 10);
  }
  // A single picture of 20 x 15 pixels: without the 64 brightest it is worth 236 * 0.5 + 300 * 0.1 = 148.
  Image picture(20, 15, 3);
  std::fill(picture.data.begin(), picture.data.end(), 0.5f);
  std::fill_n(picture.pixel(9, 7), 3, 1.4e6f);
  EXPECT_EQ(with_usable_values(picture).pixel(9, 7)[0], 1.4e6f);
  std::fill_n(picture.pixel(9, 7), 3, 1.6e6f);
  EXPECT_EQ(with_usable_values(picture).pixel(9, 7)[0], 0.5f) << "more than 10,000 times 148";
  std::fill_n(picture.pixel(9, 8), 3, 1.6e6f);
  EXPECT_EQ(with_usable_values(picture).pixel(9, 7)[0], 1.6e6f) << "a lamp of two pixels";
  std::fill(image.data.begin(), image.data.end(), std::numeric_limits<float>::quiet_NaN());
  EXPECT_EQ(with_usable_values(image).data, std::vector<float>(75, 0.0f));
}

}  // namespace
}  // namespace covary::stray_values_test
