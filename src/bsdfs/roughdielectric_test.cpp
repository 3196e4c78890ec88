// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

std::vector<Json> glasses() {
  return {
      {{"type", "roughdielectric"}, {"alpha", 0.3}},
      {{"type", "roughdielectric"}, {"distribution", "ggx"}, {"alpha", 0.2}, {"int_ior", 1.0}, {"ext_ior", 1.5}},
      {{"type", "roughdielectric"}, {"distribution", "ggx"}, {"alpha_u", 0.1}, {"alpha_v", 0.4}},
      {{"type", "roughdielectric"}, {"distribution", "ggx"}, {"alpha", 0.3}, {"sample_visible", false}},
  };
}

TEST(RoughDielectric, SamplesFollowTheDensity) {
  for (const Json& glass : glasses()) expect_sound(glass, {10, 70, 150});
  expect_rejected(glasses()[0], Planted::Bug::kDensity);
  expect_rejected(glasses()[0], Planted::Bug::kReuse, 80);
}

TEST(RoughDielectric, ImportanceIsTheAdjointOfRadiance) {
  for (const Json& glass : glasses()) EXPECT_GT(expect_adjoint(glass, {5, 60, 115, 160}), 250);
}

// No absorption; single scattering loses a little.
TEST(RoughDielectric, LosesLittlePower) {
  for (const char* distribution : {"ggx", "beckmann"}) {
    const Json glass{{"type", "roughdielectric"}, {"distribution", distribution}, {"alpha", 0.1}};
    for (const float theta : {0.0f, 45.0f, 165.0f})
      expect_albedo_within(glass, theta, 0.98, 1, TransportMode::kImportance);
    for (const float theta : {80.0f, 100.0f}) expect_albedo_within(glass, theta, 0.85, 1, TransportMode::kImportance);
  }
}

TEST(RoughDielectric, ApproachesTheSmoothInterface) {
  for (const float theta : {40.0f, 160.0f})
    for (const float u_lobe : {0.001f, 0.9f}) {
      const Vec3 wo = direction(theta, 1);
      const Bound rough({{"type", "roughdielectric"}, {"distribution", "ggx"}, {"alpha", 1e-4}}, wo);
      const Bound smooth({{"type", "dielectric"}}, wo);
      const BsdfSample r = rough->sample(wo, u_lobe, {0.3f, 0.6f}), s = smooth->sample(wo, u_lobe, {0.3f, 0.6f});
      EXPECT_LT(length(r.wi - s.wi), 2e-3f);
      EXPECT_NEAR(r.weight.g, s.weight.g, 2e-3f);
      EXPECT_EQ(r.eta, s.eta);
    }
}

TEST(RoughDielectric, EqualIndicesAreAnError) {
  expect_contains(bsdf_errors({{"type", "roughdielectric"}, {"int_ior", 1.5}, {"ext_ior", 1.5}}),
                  "bsdf 'roughdielectric': 'int_ior' and 'ext_ior' are equal; they must differ");
}

}  // namespace
}  // namespace covary::testing
