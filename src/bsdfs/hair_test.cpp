// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing {
namespace {

std::vector<Json> hairs() {
  return {
      {{"type", "hair"}},
      {{"type", "hair"}, {"longitudinal_roughness", 0.7}, {"azimuthal_roughness", 0.5}, {"eumelanin", 0.2}},
      {{"type", "hair"}, {"sigma_a", rgb(0.2, 0.25, 0.7)}, {"scale_tilt", 10.0}, {"int_ior", 1.4}},
  };
}

TEST(Hair, SamplesFollowTheDensity) {
  for (const Json& hair : hairs()) expect_sound(hair, {10, 75});
  expect_rejected(hairs()[0], Planted::Bug::kDensity);
}

TEST(Hair, LightPathsGetTheAdjoint) {
  for (const Json& hair : hairs()) EXPECT_GT(expect_adjoint(hair, {5, 45, 75}), 200);
}

TEST(Hair, WithoutPigmentsKeepsAllLight) {
  const Json clear{{"type", "hair"}, {"eumelanin", 0.0}, {"pheomelanin", 0.0}};
  for (const float theta : {5.0f, 45.0f, 80.0f}) {
    expect_albedo_within(clear, theta, 1, 1);
    expect_albedo_within(hairs()[0], theta, 0.03, 0.9);
  }
}

// Rays along the fibre and close to its edge; lowest roughness.
TEST(Hair, IsFiniteAtTheEdges) {
  for (const double roughness : {0.0, 1.0}) {
    const Json hair{{"type", "hair"}, {"longitudinal_roughness", roughness}, {"azimuthal_roughness", roughness}};
    for (const Vec3& wo : {Vec3{0, 1, 0}, Vec3{0, -1, 0}, Vec3{1, 0, 0}, Vec3{0, 0, 1}, Vec3{-0.6f, 0.8f, 0}}) {
      const Bound closure(hair, wo, TransportMode::kRadiance);
      for (const float u : {0.0f, 0.3f, kOneMinusEpsilon}) {
        const BsdfSample s = closure->sample(wo, u, {u, u});
        EXPECT_TRUE(is_finite(s.weight) && std::isfinite(s.pdf) && is_finite(s.wi)) << roughness << " " << u;
        EXPECT_LT(max_component(s.weight), 1.01f);
      }
    }
  }
}

TEST(Hair, TellsWhatCannotBe) {
  expect_contains(bsdf_errors({{"type", "hair"}, {"sigma_a", 1.0}, {"eumelanin", 1.0}}), "expected one of them");
  expect_contains(bsdf_errors({{"type", "hair"}, {"int_ior", "air"}}), "they must differ");
  expect_contains(bsdf_errors({{"type", "hair"}, {"azimuthal_roughness", 1.5}}), "azimuthal_roughness");
}

}  // namespace
}  // namespace covary::testing
