// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

TEST(Diffuse, HasTheLambertianValueOnTheFrontOnly) {
  const Vec3 wo = direction(30, 0), wi = direction(60, 2);
  const Bound closure({{"type", "diffuse"}, {"reflectance", rgb(0.2, 0.4, 0.8)}}, wo);
  const BsdfValue v = closure->eval(wo, wi);
  EXPECT_FLOAT_EQ(v.value.g, 0.4f / kPi * wi.z);
  EXPECT_FLOAT_EQ(v.pdf_solid_angle, wi.z / kPi);
  for (const auto& [a, b] : {std::pair{wo, -wi}, {-wo, wi}, {-wo, -wi}}) {
    EXPECT_TRUE(is_black(closure->eval(a, b).value));
    EXPECT_EQ(closure->eval(a, b).pdf_solid_angle, 0);
  }
  EXPECT_FALSE(closure->sample(-wo, 0.5f, {0.5f, 0.5f}).valid());
}

TEST(Diffuse, AlbedoIsTheReflectance) {
  const Vec3 wo = direction(70, 1);
  const Bound closure({{"type", "diffuse"}, {"reflectance", rgb(0.2, 0.4, 0.8)}}, wo);
  const Spectrum albedo = statistics::smooth_albedo(*closure, wo);
  EXPECT_NEAR(albedo.r, 0.2f, 2e-4f);
  EXPECT_NEAR(albedo.b, 0.8f, 2e-4f);
  EXPECT_EQ(closure.bsdf().albedo(flat_hit()), Spectrum(0.2f, 0.4f, 0.8f));
}

TEST(Diffuse, SamplesFollowTheDensity) {
  const Json plain{{"type", "diffuse"}};
  expect_sound(plain, {10, 80});
  expect_rejected(plain, Planted::Bug::kDensity);
}

TEST(Diffuse, TextureIsLookedUpAtThePoint) {
  const Textures textures{{"paint", std::make_shared<TestTexture>(Spectrum(0.1f, 0.2f, 0.3f))}};
  const Vec3 wo = direction(0, 0);
  const Bound closure({{"type", "diffuse"}, {"reflectance", {{"type", "paint"}}}}, wo, TransportMode::kRadiance,
                      textures);
  EXPECT_EQ(closure->sample(wo, 0.5f, {0.2f, 0.7f}).weight, Spectrum(0.1f, 0.2f, 0.3f));
}

TEST(Diffuse, WrongParametersAreNamed) {
  expect_contains(bsdf_errors({{"type", "diffuse"}, {"reflectence", 0.5}}), "'reflectance'");
  expect_contains(bsdf_errors({{"type", "diffuse"}, {"reflectance", rgb(0.5, 1.2, 0)}}), "must lie in [0, 1]");
}

}  // namespace
}  // namespace covary::testing
