// SPDX-License-Identifier: Apache-2.0
// bumpmap and normalmap, which differ only in the source of the normal.
#include "support/model_checks.h"

namespace covary::testing::perturbed_test {
namespace {

const Json kDiffuse{{"type", "diffuse"}};
const Json kMetal{{"type", "roughconductor"}, {"distribution", "ggx"}, {"alpha", 0.3}};
const Json kGlass{{"type", "roughdielectric"}, {"distribution", "ggx"}, {"alpha", 0.3}};

Json bump(const Json& nested) { return {{"type", "bumpmap"}, {"height", {{"type", "height"}}}, {"n", nested}}; }
Textures height(float u, float v) { return {{"height", std::make_shared<TestTexture>(Spectrum(0), Vec2{u, v})}}; }

TEST(BumpMap, FlatMapChangesNothing) {
  const Vec3 wo = direction(40, 1), wi = direction(30, 4);
  const BsdfValue flat = Bound(bump(kMetal), wo, TransportMode::kRadiance, height(0, 0))->eval(wo, wi);
  const BsdfValue plain = Bound(kMetal, wo)->eval(wo, wi);
  EXPECT_FLOAT_EQ(flat.value.g, plain.value.g);
  EXPECT_FLOAT_EQ(flat.pdf_solid_angle, plain.pdf_solid_angle);
}

TEST(BumpMap, TiltsTheNormalAgainstTheSlope) {
  // Height rises with u by 0.5 per unit: normal along (-0.5, 0, 1). Mirror reflection is about it.
  const Vec3 n = normalize({-0.5f, 0, 1}), wo = direction(10, 2);
  const BsdfSample s = Bound(bump({{"type", "conductor"}}), wo, TransportMode::kRadiance, height(0.5f, 0))
                           ->sample(wo, 0.5f, {0.5f, 0.5f});
  EXPECT_LT(length(s.wi - reflect(wo, n)), 1e-5f);
}

TEST(BumpMap, SurfaceWithoutParametersIsNotTilted) {
  const BsdfPtr bsdf = make_bsdf(bump(kDiffuse), height(1, 1));
  EXPECT_TRUE(bsdf->needs_derivatives());
  SurfaceHit hit = flat_hit();
  hit.dp_du = hit.dp_dv = {};
  Arena arena;
  const Vec3 wo = direction(30, 0), wi = direction(60, 1);
  EXPECT_FLOAT_EQ(bsdf->bind(hit, true, TransportMode::kRadiance, arena)->eval(wo, wi).value.g, 0.5f * kInvPi * wi.z);
}

TEST(BumpMap, SamplesFollowTheDensity) {
  for (const Json& nested : {kDiffuse, kMetal, kGlass}) expect_sound(bump(nested), {20, 75}, height(0.8f, -0.4f));
  expect_rejected(bump(kMetal), Planted::Bug::kDensity, 20, height(-0.3f, -0.2f));
}

TEST(BumpMap, ImportanceIsTheAdjointOfRadiance) {
  for (const Json& nested : {kDiffuse, kMetal, kGlass})
    EXPECT_GT(expect_adjoint(bump(nested), {10, 50, 80}, height(0.8f, -0.4f)), 100);
  EXPECT_GT(expect_adjoint(bump({{"type", "twosided"}, {"n", kMetal}}), {100, 150}, height(1.5f, 0.3f)), 50);
}

TEST(BumpMap, GainsNoEnergy) {
  for (const float theta : {5.0f, 60.0f, 85.0f})
    expect_albedo_within(bump({{"type", "diffuse"}, {"reflectance", 1.0}}), theta, 0.1, 1, TransportMode::kRadiance,
                         height(0.8f, -0.4f));
}

TEST(BumpMap, LetsMaskedLightPassUnchanged) {
  const Vec3 wo = direction(70, 1);
  const Bound closure(bump({{"type", "mask"}, {"opacity", 0.2}, {"n", kDiffuse}}), wo, TransportMode::kRadiance,
                      height(2, 1));
  const BsdfSample s = closure->sample(wo, 0.9f, {0.5f, 0.5f});
  EXPECT_EQ(s.flags, kNullTransmission);
  EXPECT_EQ(s.wi, -wo);
  EXPECT_EQ(s.weight, Spectrum(1));
}

TEST(BumpMap, WrongNestedObjectsAreNamed) {
  expect_contains(bsdf_errors({{"type", "bumpmap"}, {"n", kDiffuse}}), "has 0 nested textures; it takes exactly 1");
  expect_contains(bsdf_errors({{"type", "bumpmap"}, {"height", {{"type", "height"}}}}, height(0, 0)),
                  "has 0 nested reflectance models; it takes exactly 1");
}

TEST(NormalMap, StoredNormalTurnsTheMirror) {
  const Vec3 n = normalize({0.2f, -0.4f, 0.8f}), wo = direction(10, 2);
  const Json map{{"type", "normalmap"}, {"normalmap", rgb(0.6, 0.3, 0.9)}, {"n", {{"type", "conductor"}}}};
  const BsdfSample s = Bound(map, wo)->sample(wo, 0.5f, {0.5f, 0.5f});
  EXPECT_LT(length(s.wi - reflect(wo, n)), 1e-5f);
}

TEST(NormalMap, FollowsTheTangent) {
  // With dp/du along y, the stored x component points along y.
  const BsdfPtr bsdf =
      make_bsdf({{"type", "normalmap"}, {"normalmap", rgb(0.6, 0.3, 0.9)}, {"n", {{"type", "conductor"}}}});
  SurfaceHit hit = flat_hit();
  hit.dp_du = {0, 3, 0};
  hit.dp_dv = {-1, 0, 0};
  Arena arena;
  const Vec3 n = normalize({0.4f, 0.2f, 0.8f}), wo = direction(10, 2);
  const BsdfSample s = bsdf->bind(hit, true, TransportMode::kRadiance, arena)->sample(wo, 0.5f, {0.5f, 0.5f});
  EXPECT_LT(length(s.wi - reflect(wo, n)), 1e-5f);
}

TEST(NormalMap, SamplesFollowTheDensity) {
  const Json map{{"type", "normalmap"}, {"normalmap", rgb(0.7, 0.35, 0.9)}, {"n", kMetal}};
  expect_sound(map, {20, 75});
  EXPECT_GT(expect_adjoint(map, {20, 75}), 50);
}

TEST(NormalMap, MissingTextureIsNamed) {
  expect_contains(bsdf_errors({{"type", "normalmap"}, {"n", kDiffuse}}), "the texture 'normalmap' is missing");
}

}  // namespace
}  // namespace covary::testing::perturbed_test
