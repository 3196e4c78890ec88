// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

TEST(Null, PassesEverythingStraightThrough) {
  for (const float theta : {20.0f, 120.0f}) {
    const Vec3 wo = direction(theta, 1);
    const Bound closure({{"type", "null"}}, wo);
    const BsdfSample s = closure->sample(wo, 0.3f, {0.1f, 0.9f});
    EXPECT_EQ(s.wi, -wo);
    EXPECT_EQ(s.weight, Spectrum(1));
    EXPECT_EQ(s.flags, kNullTransmission);
    EXPECT_TRUE(s.is_delta());
    EXPECT_TRUE(is_black(closure->eval(wo, -wo).value));
    EXPECT_EQ(statistics::join(statistics::check_closure(*closure, wo, kModelChi2)), "");
  }
}

TEST(Null, HasNoParameters) {
  expect_contains(bsdf_errors({{"type", "null"}, {"opacity", 0.5}}), "it has no parameters");
}

}  // namespace
}  // namespace covary::testing
