// SPDX-License-Identifier: Apache-2.0
#include "emitters/equal_area_image.h"

#include <gtest/gtest.h>

#include "core/equal_area.h"
#include "core/error.h"
#include "core/random.h"
#include "emitters/environment_image.h"
#include "statistics/chi2.h"
#include "support/files.h"

namespace covary {
namespace {

TexelImage image(int width, float sun) {
  TexelImage image;
  image.width = image.height = width, image.channels = 3;
  for (int i = 0; i < width * width; ++i)
    for (int c = 0; c < 3; ++c)
      image.floats.push_back(mix64(i) % 4 == 0 ? 0 : static_cast<float>(mix64(3 * i + c + 100) >> 40) * 0x1p-24f);
  for (int c = 0; c < 3; ++c) image.floats[3 * (width * (width / 3) + width / 4) + c] += sun;
  return image;
}

/// Closed-form points of pbrt-v4's EqualAreaSquareToSphere() (src/pbrt/util/math.cpp): the centre is +z, the corners
/// are -z, the midpoints of the edges lie on the equator.
TEST(EqualArea, PlacesOfPbrt) {
  const auto expect = [](Vec2 uv, const Vec3& d) {
    EXPECT_LT(length(equal_area_direction(uv) - d), 1e-6f) << uv.x << " " << uv.y;
    const Vec2 back = equal_area_square(normalize(d + Vec3{1e-7f, 1e-7f, 0}));
    EXPECT_NEAR(back.x, uv.x, 1e-3f);
    EXPECT_NEAR(back.y, uv.y, 1e-3f);
  };
  expect({0.5f, 0.5f}, {0, 0, 1});
  expect({1, 1}, {0, 0, -1});
  expect({1, 0.5f}, {1, 0, 0});
  expect({0, 0.5f}, {-1, 0, 0});
  expect({0.5f, 1}, {0, 1, 0});
  expect({0.5f, 0}, {0, -1, 0});
  const float h = std::sqrt(0.5f);
  expect({0.75f, 0.75f}, {h, h, 0});
  // r = 1/2: z = 3/4, halfway between the axes; below, the same point mirrored across the edge of the diamond.
  const float s = std::sqrt(7.0f) / 4;
  expect({0.625f, 0.625f}, {s * h, s * h, 0.75f});
  expect({0.875f, 0.875f}, {s * h, s * h, -0.75f});
}

TEST(EqualArea, GoesForthAndBack) {
  for (int i = 0; i < 10000; ++i) {
    const Vec2 uv = PathRandom(Sampling::kIndependent, 1, 0, 0, i).get_2d(0, Event::kDirection);
    const Vec3 d = equal_area_direction(uv);
    EXPECT_NEAR(length(d), 1, 1e-6f);
    const Vec2 back = equal_area_square(d);
    EXPECT_NEAR(back.x, uv.x, 2e-4f);
    EXPECT_NEAR(back.y, uv.y, 2e-4f);
  }
}

// N = 100 000 in 64 cells, alpha = 5e-7: detects an rms error of 3.5 % of the density with power 0.99
// (statistics/chi2.h).
TEST(EqualArea, DirectionsFollowTheirDensity) {
  for (const bool compensated : {false, true}) {
    const EqualAreaImage environment(image(4, 5), 1, compensated);
    const auto sample = [&](const PathRandom& random) -> std::optional<Vec3> {
      return environment.sample(random.get_2d(0, Event::kLightPosition)).d;
    };
    const auto density = [&](const Vec3& d) { return environment.lookup(d).pdf_solid_angle; };
    const auto result =
        statistics::chi2_sphere(sample, density, {.name = "equal area", .n_samples = 100000, .n_cells = 64});
    EXPECT_TRUE(result.accepted) << result.message;
    // Planted bug: the lower hemisphere mistaken for the upper one.
    const auto wrong = statistics::chi2_sphere(sample,
                                               [&](const Vec3& d) {
                                                 return density({d.x, d.y, -d.z});
                                               },
                                               {.name = "planted", .n_samples = 50000, .n_cells = 64});
    EXPECT_FALSE(wrong.accepted);
  }
}

TEST(EqualArea, IntegralAndValuesAreThoseOfTheTexels) {
  TexelImage one = image(4, 0);
  const EqualAreaImage environment(one, 2, false);
  double sum = 0;
  for (size_t i = 0; i < one.n_pixels(); ++i) sum += 2 * one.floats[3 * i + 1];
  EXPECT_NEAR(environment.integral().g, sum * 4 * M_PI / 16, 1e-4);
  EXPECT_EQ(environment.lookup(equal_area_direction({0.3f, 0.6f})).value.g, 2 * one.floats[3 * (4 * 2 + 1) + 1]);
  const auto black =
      EqualAreaImage({.width = 2, .height = 2, .channels = 3, .floats = std::vector<float>(12, 0.0f)}, 1, false);
  EXPECT_EQ(black.sample({0.5f, 0.5f}).pdf_solid_angle, 0);
  one.height = 2, one.width = 8;
  EXPECT_TRUE(test_support::contains(test_support::message_of([&] { EqualAreaImage(one, 1, false); }),
                                     "an image of equal areas is square, but this one has 8 x 2 pixels"));
}

/// The total light changes by less than 0.2 %, even if one texel has most of it; a constant map stays constant; smooth
/// maps keep their values.
TEST(EqualArea, LatitudeAndLongitudeKeepTheLight) {
  for (const float sun : {0.0f, 1000.0f}) {
    const TexelImage square = image(32, sun);
    const Spectrum before = EqualAreaImage(square, 1, false).integral();
    const Spectrum after = EnvironmentImage(latitude_longitude_of(square), 1, false).integral();
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(after[c], before[c], 2e-3f * before[c]) << sun;
  }
  TexelImage smooth = image(64, 0);
  for (int y = 0; y < 64; ++y)
    for (int x = 0; x < 64; ++x) {
      const Vec3 d = equal_area_direction({(static_cast<float>(x) + 0.5f) / 64, (static_cast<float>(y) + 0.5f) / 64});
      for (int c = 0; c < 3; ++c) smooth.floats[3 * (64 * y + x) + c] = 2 + d[c];
    }
  const EnvironmentImage converted(latitude_longitude_of(smooth), 1, false);
  for (int i = 0; i < 1000; ++i) {
    const Vec3 d = equal_area_direction(PathRandom(Sampling::kIndependent, 1, 0, 0, i).get_2d(0, Event::kDirection));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(converted.lookup(d).value[c], 2 + d[c], 0.06f);
  }
}

}  // namespace
}  // namespace covary
