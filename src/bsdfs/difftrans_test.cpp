// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

const Json kSheet{{"type", "difftrans"}, {"reflectance", rgb(0.2, 0.4, 0.6)}, {"transmittance", rgb(0.3, 0.1, 0.2)}};

TEST(DiffTrans, IsLambertianOnBothSides) {
  const Vec3 wo = direction(30, 0), wi = direction(60, 2);
  for (const float side : {1.0f, -1.0f}) {
    const Bound closure(kSheet, wo * side);
    EXPECT_FLOAT_EQ(closure->eval(wo * side, wi * side).value.g, 0.4f / kPi * wi.z);
    EXPECT_FLOAT_EQ(closure->eval(wo * side, wi * -side).value.g, 0.1f / kPi * wi.z);
    // Sides in proportion to the means, 0.4 and 0.2.
    EXPECT_FLOAT_EQ(closure->eval(wo * side, wi * side).pdf_solid_angle, 2.0f / 3 * wi.z / kPi);
  }
}

TEST(DiffTrans, SamplesFollowTheDensity) {
  expect_sound(kSheet, {10, 80});
  expect_rejected(kSheet, Planted::Bug::kDensity);
}

}  // namespace
}  // namespace covary::testing
