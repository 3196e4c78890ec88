// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

std::vector<Json> metals() {
  return {
      {{"type", "roughconductor"}, {"alpha", 0.3}, {"material", "Au"}},
      {{"type", "roughconductor"}, {"distribution", "ggx"}, {"alpha", 0.15}},
      {{"type", "roughconductor"}, {"distribution", "ggx"}, {"alpha_u", 0.1}, {"alpha_v", 0.4}},
      {{"type", "roughconductor"}, {"distribution", "beckmann"}, {"alpha_u", 0.4}, {"alpha_v", 0.2}},
      {{"type", "roughconductor"}, {"distribution", "ggx"}, {"alpha", 0.3}, {"sample_visible", false}},
      {{"type", "roughconductor"}, {"alpha_u", 0.2}, {"alpha_v", 0.3}, {"sample_visible", false}},
  };
}

TEST(RoughConductor, SamplesFollowTheDensity) {
  for (const Json& metal : metals()) expect_sound(metal, {10, 70});
  expect_rejected(metals()[0], Planted::Bug::kDensity);
}

TEST(RoughConductor, IsReciprocal) {
  for (const Json& metal : metals()) EXPECT_GT(expect_adjoint(metal, {5, 45, 75}), 200);
}

// Single scattering loses what leaves the microsurface downwards, and gains nothing.
TEST(RoughConductor, WithoutMaterialLosesLittle) {
  for (const char* distribution : {"ggx", "beckmann"}) {
    const Json mirror{{"type", "roughconductor"}, {"distribution", distribution}, {"alpha", 0.1}};
    for (const float theta : {0.0f, 45.0f}) expect_albedo_within(mirror, theta, 0.97, 1);
    expect_albedo_within(mirror, 85, 0.8, 1);
  }
}

TEST(RoughConductor, ApproachesTheMirror) {
  const Vec3 wo = direction(40, 1);
  for (const char* distribution : {"ggx", "beckmann"}) {
    const Bound closure(
        {{"type", "roughconductor"}, {"distribution", distribution}, {"alpha", 1e-4}, {"material", "Cu"}}, wo);
    const BsdfSample s = closure->sample(wo, 0.5f, {0.3f, 0.6f});
    const BsdfSample mirror = Bound({{"type", "conductor"}, {"material", "Cu"}}, wo)->sample(wo, 0.5f, {0.3f, 0.6f});
    EXPECT_LT(length(s.wi - mirror.wi), 2e-3f);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.weight[c], mirror.weight[c], 1e-3f);
  }
}

TEST(RoughConductor, RoughnessMayBeATexture) {
  const Textures textures{{"wear", std::make_shared<TestTexture>(Spectrum(0.25f))}};
  const Vec3 wo = direction(30, 0), wi = direction(20, 2.5f);
  const Bound textured({{"type", "roughconductor"}, {"alpha", {{"type", "wear"}}}}, wo, TransportMode::kRadiance,
                       textures);
  const Bound constant({{"type", "roughconductor"}, {"alpha", 0.25}}, wo);
  EXPECT_NEAR(textured->eval(wo, wi).value.g, constant->eval(wo, wi).value.g, 1e-5f);
  EXPECT_FALSE(textured.bsdf().needs_derivatives());
  EXPECT_TRUE(make_bsdf(metals()[2])->needs_derivatives());
}

TEST(RoughConductor, WrongParametersAreNamed) {
  expect_contains(bsdf_errors({{"type", "roughconductor"}, {"alpha_u", 0.1}}),
                  "parameter 'alpha_u' of bsdf 'roughconductor' is given alone; expected both 'alpha_u' and 'alpha_v'");
  expect_contains(bsdf_errors({{"type", "roughconductor"}, {"alpha", 0.1}, {"alpha_u", 0.1}, {"alpha_v", 0.1}}),
                  "is given together with 'alpha_u' or 'alpha_v'; expected one or the other");
  expect_contains(bsdf_errors({{"type", "roughconductor"}, {"distribution", "phong"}}),
                  "is 'phong'; expected one of 'beckmann', 'ggx'");
}

}  // namespace
}  // namespace covary::testing
