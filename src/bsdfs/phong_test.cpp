// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing::phong_test {
namespace {

Json phong(double exponent) {
  return {{"type", "phong"}, {"exponent", exponent}, {"diffuse_reflectance", 0.3}, {"specular_reflectance", 0.4}};
}

TEST(Phong, SamplesFollowTheDensity) {
  for (const double exponent : {0.0, 5.0, 60.0}) expect_sound(phong(exponent), {10, 40});
  expect_rejected(phong(5), Planted::Bug::kDensity);
  expect_rejected(phong(5), Planted::Bug::kReuse);
}

TEST(Phong, IsReciprocal) { EXPECT_GT(expect_adjoint(phong(10), {5, 45, 75}), 200); }

// The lobe around the normal: ks (n + 2) / (2 pi) times the integral of cos^(n + 1), 2 pi / (n + 2).
TEST(Phong, ReflectsTheSumOfBothPartsAtNormalIncidence) {
  for (const double exponent : {5.0, 60.0}) expect_albedo_within(phong(exponent), 0, 0.7, 0.7);
}

// [LafortuneWillems1994] with Mitsuba's defaults, kd 0.5, ks 0.2, n 30: the mirror direction of 50 degrees is 10
// degrees from 60 in the plane of incidence.
TEST(Phong, FollowsTheFormula) {
  const Vec3 wo = direction(50, 0), wi = direction(60, kPi);
  const double cosine = std::cos(10 * M_PI / 180), f = 0.5 / M_PI + 0.2 * 32 / (2 * M_PI) * std::pow(cosine, 30);
  EXPECT_NEAR(Bound({{"type", "phong"}}, wo)->eval(wo, wi).value.g, f * std::cos(60 * M_PI / 180), 1e-5);
}

TEST(Phong, NegativeExponentsAreErrors) {
  expect_contains(bsdf_errors(phong(-1)), "parameter 'exponent' of bsdf 'phong' is -1; it must not be negative");
}

}  // namespace
}  // namespace covary::testing::phong_test
