// SPDX-License-Identifier: Apache-2.0
#include "plans/pixel_importance.h"

#include <gtest/gtest.h>

#include "support/plans.h"

namespace covary {
namespace {

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

/// A film of 40 x 30 pixels, two samples of `value` in each.
Film film_of(const Spectrum& value) {
  Film film(40, 30, {0, 0, 40, 30}, 1);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) film.add(x, y, value), film.add(x, y, value);
  return film;
}

std::vector<Spectrum> importance_of(const Spectrum& value) {
  const LoadedScene scene = load_sized(kRoom);
  return pixel_importance(*scene.scene, scene.filter, film_of(value), false, nullptr);
}

TEST(PixelImportance, IsInverseToTheValue) {
  const std::vector<Spectrum> importance = importance_of({0.09f, 0.99f, 9.99f});
  ASSERT_EQ(importance.size(), 40u * 30u);
  for (const Spectrum& each : importance) {
    EXPECT_NEAR(each.r, 10, 2);  // wide: a neural denoiser leaves even images only about as they are
    EXPECT_NEAR(each.g, 1, 0.2);
    EXPECT_NEAR(each.b, 0.1, 0.02);
  }
}

TEST(PixelImportance, OfABlackImageIsFinite) {
  for (const Spectrum& each : importance_of(Spectrum(0))) {
    EXPECT_GT(each.g, 50);
    EXPECT_LE(each.g, 100.001f);
  }
}

}  // namespace
}  // namespace covary
