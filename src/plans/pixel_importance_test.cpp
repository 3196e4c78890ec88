// SPDX-License-Identifier: Apache-2.0
#include "plans/training_stage.h"

#include <gtest/gtest.h>

#include <cmath>

#include "support/plans.h"

namespace covary {
namespace {

const std::string kRoom = std::string(COVARY_SOURCE_DIR) + "/scenes/room.xml";

/// A film of 40 x 30 pixels with two samples of `value` each.
Film film_of(const Spectrum& value) {
  Film film(40, 30, {0, 0, 40, 30}, 1);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) film.add(x, y, value), film.add(x, y, value);
  return film;
}

std::vector<Spectrum> importance_of(const Spectrum& value) {
  const LoadedScene scene = load_sized(kRoom);
  const Film film = film_of(value);
  return pixel_importance(pixel_features(*scene.scene, scene.filter, film, nullptr), film, std::nullopt);
}

TEST(PixelImportance, IsInverseToTheValue) {
  const std::vector<Spectrum> importance = importance_of({0.1f, 1, 10});
  ASSERT_EQ(importance.size(), 40u * 30u);
  for (const Spectrum& each : importance) {
    EXPECT_NEAR(each.r, 1 / std::sqrt(0.02f), 1e-3f);
    EXPECT_NEAR(each.g, 1 / std::sqrt(1.01f), 1e-4f);
    EXPECT_NEAR(each.b, 0.1, 1e-4);
  }
}

TEST(PixelImportance, OfABlackImageIsFinite) {
  for (const Spectrum& each : importance_of(Spectrum(0))) {
    EXPECT_NEAR(each.g, 10, 1e-3f);
  }
}

}  // namespace
}  // namespace covary
