// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing::mask_test {
namespace {

const Json kPlastic{{"type", "plastic"}};

TEST(Mask, LetsTheRestPass) {
  const Vec3 wo = direction(40, 1);
  const Bound closure({{"type", "mask"}, {"opacity", 0.3}, {"n", kPlastic}}, wo);
  const BsdfSample s = closure->sample(wo, 0.31f, {0.5f, 0.5f});
  EXPECT_EQ(s.flags, kNullTransmission);
  EXPECT_EQ(s.lobe, 2u);
  EXPECT_EQ(s.wi, -wo);
  EXPECT_FLOAT_EQ(s.pdf, 0.7f);
  const Vec3 wi = direction(50, 2);
  const BsdfValue masked = closure->eval(wo, wi), plain = Bound(kPlastic, wo)->eval(wo, wi);
  EXPECT_FLOAT_EQ(masked.value.g, 0.3f * plain.value.g);
  EXPECT_FLOAT_EQ(masked.pdf_solid_angle, 0.3f * plain.pdf_solid_angle);
}

TEST(Mask, OpacityMayBeATextureAndIsClamped) {
  const Vec3 wo = direction(40, 1);
  for (const auto& [opacity, passes] : {std::pair{1.5f, 0.0f}, {-0.5f, 1.0f}, {0.25f, 0.75f}}) {
    const Textures textures{{"holes", std::make_shared<TestTexture>(Spectrum(opacity))}};
    const Bound closure({{"type", "mask"}, {"opacity", {{"type", "holes"}}}, {"n", kPlastic}}, wo,
                        TransportMode::kRadiance, textures);
    float pmfs[kMaxLobes];
    closure->lobe_pmfs(wo, pmfs);
    EXPECT_NEAR(closure->n_lobes() == 3 ? pmfs[2] : 0, passes, 1e-4f);
  }
}

TEST(Mask, SamplesFollowTheDensity) {
  const Json mask{{"type", "mask"}, {"opacity", 0.6}, {"n", kPlastic}};
  expect_sound(mask, {30, 80, 120});
  expect_rejected(mask, Planted::Bug::kDensity);
  expect_rejected(mask, Planted::Bug::kReuse);
}

TEST(Mask, TakesOneModel) {
  expect_contains(bsdf_errors({{"type", "mask"}, {"opacity", 0.5}}),
                  "has 0 nested reflectance models; it takes exactly 1");
  expect_contains(bsdf_errors({{"type", "mask"}, {"a", kPlastic}, {"b", kPlastic}}), "has 2 nested");
}

}  // namespace
}  // namespace covary::testing::mask_test
