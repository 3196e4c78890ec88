// SPDX-License-Identifier: Apache-2.0
// `projector` against closed forms; tests/against_mitsuba compares images.
#include <gtest/gtest.h>

#include "emitters/registry.h"
#include "support/describe.h"

namespace covary {
namespace {

using namespace test_support;

Made<Emitter> make(NamedValues values) {
  values.push_back({"irradiance", ColourValue{{1, 2, 3}}});
  return make_plugin<Emitter>(emitter_plugins(), "emitter", "projector", values);
}

TEST(Projector, LightsAPlaneEvenly) {
  const auto made = make({{"fov", 90.0}, {"scale", 2.0}});
  ASSERT_EQ(made.errors, "");
  for (const Vec2 at : {Vec2{0, 0}, Vec2{1.5f, -0.5f}, Vec2{-1.9f, 1.9f}}) {
    const EmitterSample s = made.object->sample_towards({at.x, at.y, 2}, {}, 0);
    EXPECT_TRUE(s.is_delta);
    // Irradiance on the plane z = 2: pi times the image at distance 1, over 2 squared.
    EXPECT_NEAR(s.radiance.g * -s.wi.z, kPi * 2 * 2 / 4, 1e-4f);
  }
  EXPECT_EQ(made.object->sample_towards({2.1f, 0, 2}, {}, 0).radiance, Spectrum(0));
  EXPECT_EQ(made.object->sample_towards({0, 0, -2}, {}, 0).radiance, Spectrum(0));
  EXPECT_NEAR(made.object->power().b, kPi * 2 * 3 * 4, 1e-3f);
}

/// pbrt's: the same intensity in all directions of the image; the solid angle of a square of 90 degrees is 2 pi / 3.
TEST(Projector, MayHaveConstantIntensity) {
  const auto made = make({{"fov", 90.0}, {"scale", 2.0}, {"constant_intensity", true}});
  ASSERT_EQ(made.errors, "");
  for (const Vec2 at : {Vec2{0, 0}, Vec2{1.5f, -0.5f}})
    EXPECT_NEAR(made.object->sample_towards({at.x, at.y, 2}, {}, 0).radiance.g * (dot(at, at) + 4), 2 * 2, 1e-4f);
  EXPECT_NEAR(made.object->power().g, 2 * 2 * kTwoPi / 3, 1e-3f);
  EXPECT_NEAR(luminance(make({{"fov", 90.0}, {"constant_intensity", true}, {"power", 7.0}}).object->power()), 7, 1e-4f);
}

TEST(Projector, EmissionHasItsDensity) {
  const auto made = make({{"fov", 60.0}});
  ASSERT_EQ(made.errors, "");
  double power = 0;
  constexpr int kSide = 64;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec2 u{(static_cast<float>(i % kSide) + 0.5f) / kSide, (static_cast<float>(i / kSide) + 0.5f) / kSide};
    const EmissionSample s = made.object->sample_emission({}, u, 0);
    ASSERT_GT(s.pdf_direction, 0);
    EXPECT_NEAR(made.object->pdf_emission({}, s.ray.d).direction, s.pdf_direction, 1e-3f * s.pdf_direction);
    const EmitterSample towards = made.object->sample_towards(s.ray.o + s.ray.d * 3, {}, 0);
    EXPECT_NEAR(towards.radiance.r * 9, s.radiance.r, 1e-4f * s.radiance.r);
    power += s.radiance.r / s.pdf_direction / (kSide * kSide);
  }
  EXPECT_NEAR(power, made.object->power().r, 1e-3 * power);
}

TEST(Projector, NamesWhatIsWrong) {
  EXPECT_NE(make({{"fov", 180.0}}).errors.find("it must lie in (0, 180)"), std::string::npos);
  EXPECT_NE(make({{"fov", 40.0}, {"focal_length", std::string("50mm")}}).errors.find("cannot be combined with 'fov'"),
            std::string::npos);
}

}  // namespace
}  // namespace covary
