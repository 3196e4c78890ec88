// SPDX-License-Identifier: Apache-2.0
#include <tuple>

#include "support/model_checks.h"

namespace covary::testing {
namespace {

std::vector<Json> plastics() {
  return {
      {{"type", "pplastic"}, {"distribution", "ggx"}, {"alpha", 0.15}},
      {{"type", "pplastic"}, {"alpha", 0.3}, {"int_ior", 1.9}, {"diffuse_reflectance", rgb(0.1, 0.2, 0.3)}},
      {{"type", "pplastic"}, {"alpha", 0.3}, {"sample_visible", false}, {"eta", 1.4}},
  };
}

TEST(PPlastic, SamplesFollowTheDensity) {
  for (const Json& plastic : plastics()) expect_sound(plastic, {10, 75});
  expect_rejected(plastics()[0], Planted::Bug::kDensity);
}

TEST(PPlastic, IsReciprocal) {
  for (const Json& plastic : plastics()) EXPECT_GT(expect_adjoint(plastic, {5, 45, 75}), 200);
}

/// Refraction into and out of the base: (1 - F(30 degrees)) (1 - F(60 degrees)) rho / pi cos, by hand for index 1.5.
TEST(PPlastic, BaseIsSeenThroughTheSurfaceTwice) {
  const Json smooth{{"type", "pplastic"}, {"alpha", 0.01}, {"eta", 1.5}, {"diffuse_reflectance", 0.8}};
  const Vec3 wo = direction(30, 0), wi = direction(60, 1.5f);
  EXPECT_NEAR(Bound(smooth, wo)->eval(wo, wi).value.g, (1 - 0.04153f) * (1 - 0.08919f) * 0.8f * kInvPi * 0.5f, 1e-5f);
}

TEST(PPlastic, WrongParametersAreNamed) {
  expect_contains(bsdf_errors({{"type", "pplastic"}, {"int_ior", "air"}}), "they must differ");
  expect_contains(bsdf_errors({{"type", "pplastic"}, {"eta", 1.0}}), "'eta' is 1");
}

/// Unpolarised light: a polariser transmits half, a retarder all, each times its transmittance.
TEST(PolarisingFilms, LetThroughWhatMitsubaDoes) {
  const Vec3 wo = direction(40, 0.3f);
  const auto weight = [&](const char* type) {
    const BsdfSample s =
        Bound({{"type", type}, {"transmittance", rgb(0.8, 0.6, 0.4)}}, wo)->sample(wo, 0.5f, {0.5f, 0.5f});
    EXPECT_EQ(s.flags, kNullTransmission);
    EXPECT_LT(length(s.wi + wo), 1e-6f);
    return s.weight;
  };
  EXPECT_NEAR(weight("polarizer").r, std::get<0>(std::tuple{0.4f, 0.3f, 0.2f}), 1e-6f);
  EXPECT_NEAR(weight("polarizer").b, std::get<2>(std::tuple{0.4f, 0.3f, 0.2f}), 1e-6f);
  EXPECT_NEAR(weight("circular").r, std::get<0>(std::tuple{0.4f, 0.3f, 0.2f}), 1e-6f);
  EXPECT_NEAR(weight("circular").b, std::get<2>(std::tuple{0.4f, 0.3f, 0.2f}), 1e-6f);
  EXPECT_NEAR(weight("retarder").r, std::get<0>(std::tuple{0.8f, 0.6f, 0.4f}), 1e-6f);
  EXPECT_NEAR(weight("retarder").b, std::get<2>(std::tuple{0.8f, 0.6f, 0.4f}), 1e-6f);
}

}  // namespace
}  // namespace covary::testing
