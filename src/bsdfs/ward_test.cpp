// SPDX-License-Identifier: Apache-2.0
#include "support/model_checks.h"

namespace covary::testing::ward_test {
namespace {

Json ward(const char* variant) {
  return {{"type", "ward"}, {"variant", variant}, {"alpha_u", 0.2}, {"alpha_v", 0.4}, {"specular_reflectance", 0.3}};
}
constexpr const char* kVariants[] = {"balanced", "ward", "ward-duer"};

TEST(Ward, SamplesFollowTheDensity) {
  for (const char* variant : kVariants) expect_sound(ward(variant), {10, 45});
  expect_rejected(ward("balanced"), Planted::Bug::kDensity);
}

TEST(Ward, IsReciprocal) {
  for (const char* variant : kVariants) EXPECT_GT(expect_adjoint(ward(variant), {5, 45}), 150) << variant;
}

// The formulas of Mitsuba 0.6's manual (section 8.2.15) in its terms: H = wi + wo is not normalised.
TEST(Ward, FollowsTheFormulas) {
  const Vec3 wo = direction(40, 0.2f), wi = direction(52, 2.9f);
  const double x = wo.x + wi.x, y = wo.y + wi.y, z = wo.z + wi.z;
  const double exponential = std::exp(-(x * x / (0.2 * 0.2) + y * y / (0.4 * 0.4)) / (z * z));
  const double cosines = static_cast<double>(wo.z) * wi.z, area = M_PI * 0.2 * 0.4;
  const double norms[] = {(x * x + y * y + z * z) / (area * z * z * z * z), 1 / (4 * area * std::sqrt(cosines)),
                          1 / (4 * area * cosines)};
  for (int i = 0; i < 3; ++i) {
    const double expected = (0.5 / M_PI + 0.3 * norms[i] * exponential) * wi.z;
    EXPECT_NEAR(Bound(ward(kVariants[i]), wo)->eval(wo, wi).value.g, expected, 1e-4 * expected) << kVariants[i];
  }
}

TEST(Ward, UnknownVariantsAreErrors) {
  expect_contains(bsdf_errors(ward("duer")), "is 'duer'; expected one of 'balanced', 'ward', 'ward-duer'");
}

}  // namespace
}  // namespace covary::testing::ward_test
