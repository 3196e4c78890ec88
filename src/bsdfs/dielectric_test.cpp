// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

const Json kGlass{{"type", "dielectric"}, {"int_ior", 1.5}, {"ext_ior", 1.0}};

TEST(Dielectric, ReflectsTheFresnelFractionAtNormalIncidence) {
  const Vec3 wo{0, 0, 1};
  const Bound closure(kGlass, wo);
  float pmfs[2];
  closure->lobe_pmfs(wo, pmfs);
  EXPECT_NEAR(pmfs[0], 0.04f, 1e-6f);  // ((1.5 - 1) / (1.5 + 1))^2
}

TEST(Dielectric, RefractsBySnellsLawFromBothSides) {
  for (const float theta : {35.0f, 160.0f}) {
    const Vec3 wo = direction(theta, 0.4f);
    const float eta = wo.z > 0 ? 1.5f : 1 / 1.5f;
    for (const TransportMode mode : {TransportMode::kRadiance, TransportMode::kImportance}) {
      const BsdfSample s = Bound(kGlass, wo, mode)->sample(wo, 0.9f, {0.5f, 0.5f});
      EXPECT_EQ(s.flags, kDeltaTransmission);
      EXPECT_NEAR(length(s.wi), 1, 1e-6f);
      EXPECT_NEAR(s.wi.x, -wo.x / eta, 1e-6f);
      EXPECT_NEAR(s.wi.y, -wo.y / eta, 1e-6f);
      EXPECT_LT(s.wi.z * wo.z, 0);
      EXPECT_FLOAT_EQ(s.eta, eta);
      EXPECT_FLOAT_EQ(s.weight.g, mode == TransportMode::kRadiance ? 1 / (eta * eta) : 1);
    }
  }
}

TEST(Dielectric, ReflectsTotallyBeyondTheCriticalAngle) {
  const Vec3 wo = direction(130, 0);  // 50 degrees inside; critical angle 41.8
  const Bound closure(kGlass, wo);
  float pmfs[2];
  closure->lobe_pmfs(wo, pmfs);
  EXPECT_EQ(pmfs[0], 1);
  EXPECT_EQ(closure->sample(wo, kOneMinusEpsilon, {0.5f, 0.5f}).flags, kDeltaReflection);
}

TEST(Dielectric, LobesFitTogether) {
  expect_sound(kGlass, {5, 75, 150});
  expect_rejected(kGlass, Planted::Bug::kPmf, 85);
}

TEST(Dielectric, ConservesPower) {
  for (const float theta : {0.0f, 60.0f, 100.0f, 170.0f})
    expect_albedo_within(kGlass, theta, 1, 1, TransportMode::kImportance);
}

TEST(Dielectric, TakesIndicesByName) {
  const Vec3 wo = direction(40, 0);
  const float by_name = Bound({{"type", "dielectric"}, {"int_ior", "Water"}, {"ext_ior", "vacuum"}}, wo)
                            ->sample(wo, 0.9f, {0.5f, 0.5f})
                            .eta;
  EXPECT_FLOAT_EQ(by_name, 1.333f);
  EXPECT_FLOAT_EQ(Bound({{"type", "dielectric"}}, wo)->sample(wo, 0.9f, {0.5f, 0.5f}).eta, 1.5046f / 1.000277f);
}

TEST(Dielectric, WrongParametersAreNamed) {
  const std::string text = bsdf_errors({{"type", "dielectric"}, {"int_ior", "watter"}});
  expect_contains(text, "parameter 'int_ior' of bsdf 'dielectric' is the unknown material 'watter'");
  expect_contains(text, "expected a number in [0.01, 100] or one of vacuum");
  expect_contains(text, "did you mean 'water'");
  expect_contains(bsdf_errors({{"type", "dielectric"}, {"ext_ior", -1.0}}), "it must lie in [0.01, 100]");
}

}  // namespace
}  // namespace covary::testing
