// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

// A white base absorbs nothing, so all light returns: F(wo) by the mirror lobe, the rest by the diffuse one. The two
// fits of the mean Fresnel reflectance are accurate to 0.2 %, amplified to 0.5 % by the trapped light (60 %).
TEST(Plastic, WhiteBaseReflectsEverything) {
  for (const double ior : {1.3, 1.49, 1.8})
    for (const float theta : {5.0f, 50.0f, 80.0f})
      expect_albedo_within({{"type", "plastic"}, {"diffuse_reflectance", 1.0}, {"int_ior", ior}}, theta, 0.995, 1.005);
}

TEST(Plastic, NonlinearBaseIsDarker) {
  const Vec3 wo = direction(30, 0), wi = direction(50, 1);
  const auto value = [&](bool nonlinear) {
    return Bound({{"type", "plastic"}, {"diffuse_reflectance", rgb(0.9, 0.5, 0.1)}, {"nonlinear", nonlinear}}, wo)
        ->eval(wo, wi)
        .value;
  };
  const Spectrum linear = value(false), nonlinear = value(true);
  // (1 - Fi) / (1 - rho Fi) with Fi = 0.6 within 1 %
  EXPECT_NEAR(nonlinear.r / linear.r, 0.4f / (1 - 0.9f * 0.6f), 0.01f);
  EXPECT_NEAR(nonlinear.b / linear.b, 0.4f / (1 - 0.1f * 0.6f), 0.01f);
}

TEST(Plastic, SamplesFollowTheDensity) {
  const Json plastic{{"type", "plastic"}, {"diffuse_reflectance", rgb(0.1, 0.2, 0.3)}};
  expect_sound(plastic, {10, 60, 86});
  expect_rejected(plastic, Planted::Bug::kDensity);
  expect_rejected(plastic, Planted::Bug::kReuse, 80);
  expect_rejected(plastic, Planted::Bug::kPmf, 86);
}

TEST(Plastic, IsReciprocal) { EXPECT_GT(expect_adjoint({{"type", "plastic"}}, {10, 50, 80}), 100); }

TEST(Plastic, IsBlackFromBehind) {
  const Vec3 wo = direction(130, 0);
  const Bound closure({{"type", "plastic"}}, wo);
  EXPECT_FALSE(closure->sample(wo, 0.01f, {0.5f, 0.5f}).valid());
  EXPECT_TRUE(is_black(closure->eval(wo, direction(30, 0)).value));
  float pmfs[2];
  closure->lobe_pmfs(wo, pmfs);
  EXPECT_EQ(pmfs[0] + pmfs[1], 0);
}

}  // namespace
}  // namespace covary::testing
