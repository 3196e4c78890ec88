// SPDX-License-Identifier: Apache-2.0
// Phase functions sample their densities: chi-square tests with N = 400 000 at alpha = 5e-7 (statistics/chi2.h), which
// detect an rms error of 2 % of the density; a planted density of slightly different asymmetry must be rejected.
#include <gtest/gtest.h>

#include "media/registry.h"
#include "statistics/chi2.h"
#include "support/describe.h"

namespace covary {
namespace {

using test_support::make_plugin;

PhasePtr hg(double g) { return make_plugin<PhaseFunction>(phase_plugins(), "phase", "hg", {{"g", g}}).object; }

statistics::Chi2Result compare(const PhaseFunction& sampled, const PhaseFunction& claimed, const Vec3& d) {
  return statistics::chi2_sphere(
      [&](const PathRandom& random) { return std::optional(sampled.sample(d, random.get_2d(0, Event::kDirection))); },
      [&](const Vec3& w) { return claimed.pdf(d, w); });
}

const Vec3 kDirection = normalize(Vec3{0.3f, -0.5f, 0.8f});

TEST(PhaseFunctions, DrawTheirDensities) {
  for (const char* name : {"isotropic", "rayleigh"}) {
    const auto phase = make_plugin<PhaseFunction>(phase_plugins(), "phase", name, {}).object;
    const auto result = compare(*phase, *phase, kDirection);
    EXPECT_TRUE(result.accepted) << name << result.message;
  }
  for (const double g : {-0.7, -0.2, 0.0, 0.0005, 0.5, 0.85}) {
    SCOPED_TRACE(g);
    const auto result = compare(*hg(g), *hg(g), kDirection);
    EXPECT_TRUE(result.accepted) << result.message;
  }
}

TEST(PhaseFunctions, AnotherAsymmetryIsFound) {
  EXPECT_FALSE(compare(*hg(0.5), *hg(0.53), kDirection).accepted);
  EXPECT_FALSE(compare(*hg(0.3), *hg(-0.3), kDirection).accepted);
}

/// Forward and backward scattering is twice as likely as sideways.
TEST(PhaseFunctions, RayleighHasItsShape) {
  const auto rayleigh = make_plugin<PhaseFunction>(phase_plugins(), "phase", "rayleigh", {}).object;
  const auto isotropic = make_plugin<PhaseFunction>(phase_plugins(), "phase", "isotropic", {}).object;
  EXPECT_FLOAT_EQ(rayleigh->pdf({0, 0, 1}, {0, 0, -1}), 3 / (8 * kPi));
  EXPECT_FLOAT_EQ(rayleigh->pdf({0, 0, 1}, {0, 1, 0}), 3 / (16 * kPi));
  EXPECT_FALSE(compare(*rayleigh, *isotropic, kDirection).accepted);
}

TEST(PhaseFunctions, TheMeanCosineIsG) {
  for (const double g : {-0.9, -0.3, 0.0005, 0.4, 0.9}) {
    const PhasePtr phase = hg(g);
    double sum = 0;
    constexpr int kSteps = 2000;
    for (int i = 0; i < kSteps; ++i) sum += dot(kDirection, phase->sample(kDirection, {(i + 0.5f) / kSteps, 0.3f}));
    EXPECT_NEAR(sum / kSteps, g, 2e-4) << g;
  }
}

TEST(PhaseFunctions, AsymmetriesOutsideTheRangeAreErrors) {
  const auto made = make_plugin<PhaseFunction>(phase_plugins(), "phase", "hg", {{"g", 1.0}});
  EXPECT_EQ(made.errors, "test.xml:2:1: parameter 'g' of phase 'hg' is 1; it must lie in [-0.9999, 0.9999]");
}

}  // namespace
}  // namespace covary
