// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

TEST(Conductor, WithoutMaterialIsAPerfectMirror) {
  for (const float theta : {0.0f, 45.0f, 89.0f}) {
    const Vec3 wo = direction(theta, 0.5f);
    const Bound closure({{"type", "conductor"}}, wo);
    const BsdfSample s = closure->sample(wo, 0.5f, {0.5f, 0.5f});
    EXPECT_EQ(s.wi, (Vec3{-wo.x, -wo.y, wo.z}));
    EXPECT_EQ(s.pdf, 1);
    EXPECT_EQ(s.flags, kDeltaReflection);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.weight[c], 1, 1e-5f);
    EXPECT_FALSE(closure->sample(-wo, 0.5f, {0.5f, 0.5f}).valid());
  }
}

TEST(Conductor, HasTheFresnelReflectanceAtNormalIncidence) {
  const Vec3 wo{0, 0, 1};
  const Bound closure({{"type", "conductor"}, {"eta", 0.5}, {"k", 3.0}, {"specular_reflectance", 0.5}}, wo);
  const float expected = 0.5f * (0.5f * 0.5f + 9) / (1.5f * 1.5f + 9);  // ((n-1)^2 + k^2) / ((n+1)^2 + k^2)
  EXPECT_NEAR(closure->sample(wo, 0.5f, {0.5f, 0.5f}).weight.g, expected, 1e-5f);
  EXPECT_NEAR(closure.bsdf().albedo(flat_hit()).g, expected, 1e-5f);
}

TEST(Conductor, LobesFitTogether) {
  expect_sound({{"type", "conductor"}, {"material", "Cu"}}, {10, 70});
  expect_rejected({{"type", "conductor"}, {"material", "Cu"}}, Planted::Bug::kPmf);
}

TEST(Conductor, WrongParametersAreNamed) {
  const std::string text = bsdf_errors({{"type", "conductor"}, {"material", "cu"}});
  expect_contains(text,
                  "parameter 'material' of bsdf 'conductor' is the unknown conductor 'cu'; expected one of none, Ag");
  expect_contains(text, "did you mean");
  expect_contains(bsdf_errors({{"type", "conductor"}, {"material", "Au"}, {"k", 1.0}}),
                  "is 'Au' together with 'eta' or 'k'; expected one or the other");
}

}  // namespace
}  // namespace covary::testing
