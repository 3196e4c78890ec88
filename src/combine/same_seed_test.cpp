// SPDX-License-Identifier: Apache-2.0
// Groups of one seed are found, exact to the bit or not; groups of different seeds pass, whatever else they share.
// Seeds are fixed.
#include "combine/same_seed.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <limits>
#include <string>

#include "estimators/test_images.h"

namespace covary::same_seed_test {
namespace {

constexpr int kWidth = 90, kHeight = 64;

std::string findings(const test::Grouped& image, int rows = kHeight) {
  SameSeedChecks checks(image.width, image.height, image.groups);
  for (int y = 0; y < image.height; y += rows) checks.add_rows(rows_of(image.view(), y, std::min(rows, kHeight - y)));
  std::vector<Finding> found;
  checks.report({"image", {}}, found);
  return found.empty() ? "" : found[0].text;
}

/// An image of which value(x, y, t, c) are the groups.
test::Grouped image_of(int groups, const std::function<float(int, int, int, int)>& value) {
  test::Grouped image = test::constant_image(kWidth, kHeight, groups, 0);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int i = 0; i < 3 * groups; ++i) image.pixel(x, y)[i] = value(x, y, i / 3, i % 3);
  return image;
}

uint64_t place(int x, int y) { return 1 + static_cast<uint64_t>(y) * kWidth + x; }

/// Group `to` becomes group 0 up to a relative error of `rounding`; a part `elsewhere` of the pixels keep their values.
test::Grouped repeated(test::Grouped image, int to, float rounding, float elsewhere) {
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (int c = 0; c < 3 && test::noise(5, place(x, y), 0) + 0.5f >= elsewhere; ++c)
        image.pixel(x, y)[3 * to + c] = image.pixel(x, y)[c] * (1 + rounding * test::noise(6, place(x, y), c));
  return image;
}

test::Grouped good(int groups) { return test::independent_image(kWidth, kHeight, groups, 3); }

TEST(SameSeed, DifferentSeedsPass) {
  for (const int groups : {2, 3, 12}) EXPECT_EQ(findings(good(groups)), "") << groups;
  EXPECT_EQ(findings(test::crn_image(kWidth, kHeight, 2, 1)), "") << "groups of common random numbers differ";
}

TEST(SameSeed, OneSeedIsFound) {
  EXPECT_EQ(
      findings(repeated(good(12), 9, 0, 0)),
      "image: render 1 and render 10 are identical: the same seed was rendered twice, or there is no noise to remove; "
      "give every render its own seed (in Blender scene.cycles.seed, in Mitsuba seed of mi.render(), in pbrt --seed, "
      "in LuxCore renderengine.seed)");
  const test::Grouped rounded = repeated(good(2), 1, 1e-5f, 0.01f);  // 4 % of the squares of 2 x 2 pixels differ
  EXPECT_NE(findings(rounded).find("render 1 and render 2 have the same noise: the same seed"), std::string::npos);
  EXPECT_EQ(findings(rounded), findings(rounded, 16)) << "in bands";
}

TEST(SameSeed, OneSeedIsFoundBesideItselfInHalfFloats) {
  EXPECT_NE(findings(repeated(good(2), 1, 1e-3f, 0)), "") << "relative errors of up to 2^-11";
}

TEST(SameSeed, FoundBesideABadValueAndABlackHalf) {
  test::Grouped image = repeated(good(3), 2, 1e-5f, 0);
  image.pixel(4, 4)[0] = std::numeric_limits<float>::infinity();
  for (int y = 0; y < kHeight / 2; ++y)
    for (int x = 0; x < kWidth; ++x) std::fill_n(image.pixel(x, y), 9, 0.0f);
  EXPECT_NE(findings(image).find("render 1 and render 3"), std::string::npos);
}

TEST(SameSeed, EqualPartsWithoutNoiseAreNoEvidence) {
  EXPECT_EQ(findings(test::constant_image(kWidth, kHeight, 3, 0)), "");
  EXPECT_EQ(findings(test::constant_image(kWidth, kHeight, 3, 0.7f)), "");
  // A light that is seen in all groups, and others that few samples find: two groups are otherwise black.
  const auto rare = image_of(8, [](int x, int y, int t, int) {
    if (x / 20 == 2 && y / 20 == 1) return 500.0f;
    return x == 10 * t && y == 5 * t && t > 2 ? 3.0f : 0.0f;
  });
  EXPECT_EQ(findings(rare), "");
  // A smooth picture without noise, computed twice.
  EXPECT_EQ(findings(image_of(2,
                              [](int x, int y, int t, int c) {
                                return static_cast<float>(test::expected(x, y, c)) *
                                       (1 + 1e-7f * static_cast<float>(t));
                              })),
            "");
}

TEST(SameSeed, TextureIsNoNoise) {
  // Texture everywhere, a hundred times as strong as the noise.
  const auto textured = image_of(2, [](int x, int y, int t, int c) {
    const float texture = 1 + test::noise(9, place(x, y), c);
    return texture * (1 + 0.01f * test::noise(10 + t, place(x, y), c));
  });
  EXPECT_EQ(findings(textured), "");
  // A background without any noise in nine tenths of the picture.
  const auto plate = image_of(
      2, [](int x, int y, int t, int c) { return 1 + test::noise(x < kWidth / 10 ? 10 + t : 9, place(x, y), c); });
  EXPECT_EQ(findings(plate), "");
}

TEST(SameSeed, FilteredRendersOfDifferentSeedsPass) {
  const test::Grouped raw = good(2);
  const auto filtered = image_of(2, [&](int x, int y, int t, int c) {
    float sum = 0, n = 0;
    for (int j = std::max(0, y - 4); j <= std::min(kHeight - 1, y + 4); ++j)
      for (int i = std::max(0, x - 4); i <= std::min(kWidth - 1, x + 4); ++i)
        sum += raw.view().pixel(i, j)[3 * t + c], n += 1;
    return sum / n;
  });
  EXPECT_EQ(findings(filtered), "");
}

}  // namespace
}  // namespace covary::same_seed_test
