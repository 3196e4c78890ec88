// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

const Json kRed{{"type", "diffuse"}, {"reflectance", rgb(0.8, 0.1, 0.1)}};
const Json kGreen{{"type", "diffuse"}, {"reflectance", rgb(0.1, 0.8, 0.1)}};

TEST(TwoSided, ShowsOneModelOnBothSides) {
  const Json both{{"type", "twosided"}, {"a", {{"type", "roughconductor"}, {"alpha", 0.3}}}};
  const Vec3 wo = direction(40, 0.3f), wi = direction(25, 2.8f);
  const auto mirrored = [](const Vec3& w) { return Vec3{w.x, w.y, -w.z}; };
  const BsdfValue front = Bound(both, wo)->eval(wo, wi);
  const BsdfValue back = Bound(both, mirrored(wo))->eval(mirrored(wo), mirrored(wi));
  EXPECT_GT(front.value.g, 0);
  EXPECT_EQ(front.value, back.value);
  EXPECT_EQ(front.pdf_solid_angle, back.pdf_solid_angle);
}

TEST(TwoSided, ShowsTheFirstModelInFront) {
  const Json both{{"type", "twosided"}, {"a", kRed}, {"b", kGreen}};
  const Vec3 wo = direction(40, 0.3f);
  EXPECT_GT(Bound(both, wo)->sample(wo, 0.5f, {0.5f, 0.5f}).weight.r, 0.5f);
  const BsdfSample behind = Bound(both, -wo)->sample(-wo, 0.5f, {0.5f, 0.5f});
  EXPECT_GT(behind.weight.g, 0.5f);
  EXPECT_LT(behind.wi.z, 0);
}

TEST(TwoSided, SamplesFollowTheDensity) {
  const Json both{
      {"type", "twosided"}, {"a", {{"type", "roughplastic"}, {"alpha", 0.3}}}, {"b", {{"type", "plastic"}}}};
  expect_sound(both, {40, 140});
  expect_rejected(both, Planted::Bug::kDensity, 140);
}

TEST(TwoSided, WrongNestedModelsAreNamed) {
  expect_contains(bsdf_errors({{"type", "twosided"}}),
                  "bsdf 'twosided': has 0 nested reflectance models; it takes 1 or 2");
  expect_contains(bsdf_errors({{"type", "twosided"}, {"a", {{"type", "dielectric"}}}}),
                  "a nested model transmits light; expected one that only reflects");
  EXPECT_EQ(bsdf_errors({{"type", "twosided"}, {"a", {{"type", "dielectric"}}}, {"allow_transmission", true}}), "");
}

}  // namespace
}  // namespace covary::testing
