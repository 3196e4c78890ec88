// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing::coating_test {
namespace {

Json coat(const char* type, const Json& nested) {
  Json model{{"type", type}, {"n", nested}, {"int_ior", 1.5}, {"ext_ior", 1.0}};
  if (std::string(type) == "roughcoating") model["alpha"] = 0.3, model["distribution"] = "ggx";
  return model;
}

const Json kMetal{{"type", "roughconductor"}, {"alpha", 0.4}, {"material", "Au"}};
constexpr const char* kTypes[] = {"coating", "roughcoating"};

std::vector<Json> nested_models() {
  return {{{"type", "diffuse"}},
          kMetal,
          {{"type", "conductor"}},
          {{"type", "plastic"}},
          {{"type", "mask"}, {"opacity", 0.6}, {"n", {{"type", "diffuse"}}}}};
}

TEST(Coating, SamplesFollowTheDensity) {
  for (const char* type : kTypes)
    for (const Json& nested : nested_models()) expect_sound(coat(type, nested), {10, 65});
  for (const char* type : kTypes) expect_rejected(coat(type, kMetal), Planted::Bug::kDensity);
}

TEST(Coating, IsReciprocal) {
  for (const char* type : kTypes) EXPECT_GT(expect_adjoint(coat(type, kMetal), {5, 45, 70}), 120) << type;
}

// A coated diffuse model is plastic without the light that the coat reflects back down: plastic's series of bounces,
// 1 / (1 - rho Fi), is 1 for a very dark base.
TEST(Coating, IsPlasticWithoutRepeatedScattering) {
  for (const auto& [type, plastic] : {std::pair("coating", "plastic"), std::pair("roughcoating", "roughplastic")}) {
    Json dark{{"type", plastic}, {"diffuse_reflectance", 1e-4}, {"nonlinear", true}, {"int_ior", 1.5},
              {"ext_ior", 1.0},  {"specular_reflectance", 0.0}};
    Json coated = coat(type, {{"type", "diffuse"}, {"reflectance", 1e-4}});
    coated["specular_reflectance"] = 0.0;
    if (coated.contains("alpha")) dark["alpha"] = 0.3, dark["distribution"] = "ggx";
    for (const float theta : {10.0f, 50.0f, 80.0f}) {
      const Vec3 wo = direction(theta, 0), wi = direction(35, 2);
      const float expected = Bound(dark, wo)->eval(wo, wi).value.g;
      EXPECT_NEAR(Bound(coated, wo)->eval(wo, wi).value.g, expected, 1e-3f * expected) << type << " " << theta;
    }
  }
}

// Beer-Lambert law along the refracted ways down and up, sin(theta') = sin(theta) / 1.5.
TEST(Coating, AbsorbsAlongBothWays) {
  const Vec3 wo = direction(30, 0), wi = direction(60, 1);
  Json clear = coat("coating", {{"type", "diffuse"}}), tinted = clear;
  tinted["sigma_a"] = rgb(0.1, 0.5, 2), tinted["thickness"] = 0.7;
  const auto cosine = [](double degrees) {
    const double s = std::sin(degrees * M_PI / 180) / 1.5;
    return std::sqrt(1 - s * s);
  };
  const double length = 0.7 * (1 / cosine(30) + 1 / cosine(60));
  const Spectrum a = Bound(clear, wo)->eval(wo, wi).value, b = Bound(tinted, wo)->eval(wo, wi).value;
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[c] / a[c], std::exp(-(c == 0 ? 0.1 : c == 1 ? 0.5 : 2) * length), 1e-5);
}

// Over a black base, what remains is the layer's reflection: Fresnel's formula at normal incidence, ((1.5 - 1) / (1.5 +
// 1))^2 = 0.04.
TEST(Coating, ReflectsLikeADielectric) {
  const Json black{{"type", "diffuse"}, {"reflectance", 0.0}};
  expect_albedo_within(coat("coating", black), 0, 0.04, 0.04);
}

TEST(Coating, WrongParametersAreNamed) {
  expect_contains(bsdf_errors({{"type", "coating"}}), "has 0 nested reflectance models; it takes exactly 1");
  Json equal = coat("coating", kMetal);
  equal["int_ior"] = 1.0;
  expect_contains(bsdf_errors(equal), "they must differ");
}

}  // namespace
}  // namespace covary::testing::coating_test
