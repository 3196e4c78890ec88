// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

const Json kDiffuse{{"type", "diffuse"}};
const Json kMetal{{"type", "roughconductor"}, {"distribution", "ggx"}, {"alpha", 0.3}, {"material", "Au"}};
const Json kPlastic{{"type", "plastic"}};

TEST(BlendBsdf, IsTheWeightedMean) {
  const Vec3 wo = direction(40, 1), wi = direction(30, 4);
  const BsdfValue mixed =
      Bound({{"type", "blendbsdf"}, {"weight", 0.3}, {"a", kDiffuse}, {"b", kMetal}}, wo)->eval(wo, wi);
  const BsdfValue a = Bound(kDiffuse, wo)->eval(wo, wi), b = Bound(kMetal, wo)->eval(wo, wi);
  EXPECT_FLOAT_EQ(mixed.value.r, 0.7f * a.value.r + 0.3f * b.value.r);
  EXPECT_FLOAT_EQ(mixed.pdf_solid_angle, 0.7f * a.pdf_solid_angle + 0.3f * b.pdf_solid_angle);
}

TEST(BlendBsdf, SamplesFollowTheDensity) {
  const Json smooth{{"type", "blendbsdf"}, {"weight", 0.4}, {"a", kDiffuse}, {"b", kMetal}};
  expect_sound(smooth, {20, 75});
  expect_rejected(smooth, Planted::Bug::kDensity);
  expect_rejected(smooth, Planted::Bug::kReuse);
  // Delta and smooth lobes, and the two ends.
  expect_sound({{"type", "blendbsdf"}, {"weight", 0.7}, {"a", kPlastic}, {"b", {{"type", "dielectric"}}}}, {40, 80});
  expect_sound({{"type", "blendbsdf"}, {"weight", 0.0}, {"a", kPlastic}, {"b", kMetal}}, {40});
  expect_sound({{"type", "blendbsdf"}, {"weight", 1.0}, {"a", kPlastic}, {"b", kMetal}}, {40});
}

TEST(BlendBsdf, TooManyLobesAreAnError) {
  Json nested = kPlastic;
  for (int i = 0; i < 4; ++i) nested = {{"type", "blendbsdf"}, {"weight", 0.5}, {"a", kPlastic}, {"b", nested}};
  try {
    const Bound closure(nested, direction(10, 0));
    FAIL();
  } catch (const Error& error) {
    expect_contains(error.what(), "'blendbsdf': the nested models have too many lobes; at most 8 together");
  }
}

TEST(BlendBsdf, WrongParametersAreNamed) {
  expect_contains(bsdf_errors({{"type", "blendbsdf"}, {"a", kDiffuse}, {"b", kMetal}}),
                  "the number or texture 'weight' is missing");
  expect_contains(bsdf_errors({{"type", "blendbsdf"}, {"weight", 0.5}, {"a", kDiffuse}}),
                  "has 1 nested reflectance models; it takes exactly 2");
}

}  // namespace
}  // namespace covary::testing
