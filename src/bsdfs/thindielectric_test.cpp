// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

const Json kPane{{"type", "thindielectric"}, {"int_ior", 1.5}, {"ext_ior", 1.0}};

TEST(ThinDielectric, SumsTheReflectionsInsideThePane) {
  for (const float theta : {0.0f, 180.0f}) {
    const Vec3 wo = direction(theta, 0);
    float pmfs[2];
    Bound(kPane, wo)->lobe_pmfs(wo, pmfs);
    const double r = 0.04, t = 1 - r;
    double sum = r;
    for (int i = 0; i < 20; ++i) sum += t * std::pow(r, 2 * i + 1) * t;
    EXPECT_NEAR(pmfs[0], sum, 1e-6);
  }
}

TEST(ThinDielectric, TransmitsStraightThrough) {
  const Vec3 wo = direction(50, 2);
  const BsdfSample s = Bound(kPane, wo)->sample(wo, 0.99f, {0.5f, 0.5f});
  EXPECT_EQ(s.wi, -wo);
  EXPECT_EQ(s.flags, kNullTransmission);
  EXPECT_EQ(s.eta, 1);
}

TEST(ThinDielectric, LobesFitTogether) {
  expect_sound(kPane, {20, 80, 110});
  expect_rejected(kPane, Planted::Bug::kPmf, 86);
}

TEST(ThinDielectric, ConservesPower) {
  for (const float theta : {0.0f, 70.0f, 130.0f}) expect_albedo_within(kPane, theta, 1, 1);
}

}  // namespace
}  // namespace covary::testing
