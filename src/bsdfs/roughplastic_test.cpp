// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing::roughplastic_test {
namespace {

std::vector<Json> plastics() {
  return {
      {{"type", "roughplastic"}, {"distribution", "ggx"}, {"alpha", 0.15}},
      {{"type", "roughplastic"}, {"alpha", 0.3}, {"int_ior", 1.9}, {"diffuse_reflectance", rgb(0.1, 0.2, 0.3)}},
      {{"type", "roughplastic"},
       {"distribution", "ggx"},
       {"alpha", 0.3},
       {"sample_visible", false},
       {"nonlinear", true}},
  };
}

TEST(RoughPlastic, SamplesFollowTheDensity) {
  for (const Json& plastic : plastics()) expect_sound(plastic, {10, 75});
  expect_rejected(plastics()[0], Planted::Bug::kDensity);
  expect_rejected(plastics()[0], Planted::Bug::kReuse, 75);
}

TEST(RoughPlastic, IsReciprocal) {
  for (const Json& plastic : plastics()) EXPECT_GT(expect_adjoint(plastic, {5, 45, 75}), 200);
}

// As for plastic.cpp, minus what single scattering at the rough interface loses.
TEST(RoughPlastic, WhiteBaseReflectsNearlyEverything) {
  for (const char* distribution : {"ggx", "beckmann"}) {
    const Json white{
        {"type", "roughplastic"}, {"distribution", distribution}, {"alpha", 0.1}, {"diffuse_reflectance", 1.0}};
    for (const float theta : {5.0f, 60.0f}) expect_albedo_within(white, theta, 0.9, 1);
  }
}

TEST(RoughPlastic, BaseApproachesThatOfSmoothPlastic) {
  const Vec3 wo = direction(30, 0), wi = direction(55, 1.5f);  // far from the mirror direction
  const float smooth = Bound({{"type", "plastic"}}, wo)->eval(wo, wi).value.g;
  const float rough = Bound({{"type", "roughplastic"}, {"alpha", 0.005}}, wo)->eval(wo, wi).value.g;
  // The mean over the table's entries (see roughplastic.cpp) is 1.7 % below the integral that plastic uses for Ri.
  EXPECT_NEAR(rough / smooth, (1 - 0.596f) / (1 - 0.983f * 0.596f), 0.01f);
}

TEST(RoughPlastic, EachInterfaceHasItsOwnTransmittance) {
  const Vec3 w = direction(60, 0);
  const auto value = [&](const char* distribution, double alpha, double ior) {
    return Bound({{"type", "roughplastic"},
                  {"distribution", distribution},
                  {"alpha", alpha},
                  {"int_ior", ior},
                  {"specular_reflectance", 0.0}},
                 w)
        ->eval(w, w)
        .value.g;
  };
  const Bound first({{"type", "roughplastic"}, {"alpha", 0.3}}, w);  // keeps its table alive
  const float same = value("beckmann", 0.3, 1.49);
  EXPECT_EQ(value("beckmann", 0.3, 1.49), same);
  for (const float other : {value("ggx", 0.3, 1.49), value("beckmann", 0.5, 1.49), value("beckmann", 0.3, 1.6)})
    EXPECT_GT(std::abs(other / same - 1), 1e-3f);
}

/// At the roughness of a table, 3.5 / 16, nothing differs; between tables, and along u and v, samples keep to the
/// density.
TEST(RoughPlastic, MayBeRougherAlongOneAxis) {
  const Vec3 wo = direction(50, 0.3f), wi = direction(40, 2.5f);
  const auto value = [&](const Json& more) {
    Json model{{"type", "roughplastic"}, {"distribution", "ggx"}};
    model.update(more);
    return Bound(model, wo)->eval(wo, wi).value.g;
  };
  EXPECT_FLOAT_EQ(value({{"alpha_u", 0.21875}, {"alpha_v", 0.21875}}), value({{"alpha", 0.21875}}));
  const Json stretched{{"type", "roughplastic"}, {"distribution", "ggx"}, {"alpha_u", 0.1}, {"alpha_v", 0.4}};
  expect_sound(stretched, {10, 70});
  EXPECT_NE(value({{"alpha_u", 0.1}, {"alpha_v", 0.4}}), value({{"alpha_u", 0.4}, {"alpha_v", 0.1}}));
}

TEST(RoughPlastic, WrongParametersAreNamed) {
  expect_contains(bsdf_errors({{"type", "roughplastic"}, {"int_ior", "air"}}), "they must differ");
}

}  // namespace
}  // namespace covary::testing::roughplastic_test
