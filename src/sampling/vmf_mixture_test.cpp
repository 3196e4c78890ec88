// SPDX-License-Identifier: Apache-2.0
// Densities and sampling of von Mises-Fisher lobes and mixtures: integrals by quadrature, chi-square tests with the N
// and alpha of statistics/chi2.h, each with a planted bug that is rejected.
#include "sampling/vmf_mixture.h"

#include <gtest/gtest.h>

#include "core/frame.h"
#include "core/trigonometry.h"
#include "statistics/chi2.h"

namespace covary {
namespace {

const Vec3 kDirection = normalize(Vec3{0.3f, -0.7f, 0.4f});

/// ∫ v over the sphere, by the trapezoidal rule in t = 1 − cos θ over the range that contains the mass.
double integral(float kappa) {
  const Vmf lobe{{0, 0, 1}, kappa};
  const double end = std::min(2.0, 40.0 / std::max(kappa, 1e-3f));
  const int n = 20000;
  double sum = 0;
  for (int i = 0; i < n; ++i) {
    const double t = (i + 0.5) / n * end;
    const Vec3 w = {static_cast<float>(std::sqrt(t * (2 - t))), 0, static_cast<float>(1 - t)};
    sum += vmf::pdf(lobe, w) * 2 * M_PI * end / n;
  }
  return sum;
}

TEST(Vmf, IntegratesToOneForEveryConcentration) {
  for (const float kappa : {0.0f, 1e-8f, 1e-3f, 0.1f, 0.249f, 0.251f, 1.0f, 10.0f, 1e3f, 1e4f})
    EXPECT_NEAR(integral(kappa), 1, 2e-3) << kappa;  // directions near the pole are rounded to multiples of 6e-8
}

TEST(Vmf, ExponentialIsAccurate) {
  for (float x = 0; x > -80; x -= 0.37f) EXPECT_NEAR(vmf::exp_nonpositive(x) / std::exp(double{x}), 1, 1e-5) << x;
  EXPECT_EQ(vmf::exp_nonpositive(0), 1);
  EXPECT_EQ(vmf::exp_nonpositive(-1e30f), 0);
}

TEST(Vmf, SamplesHaveTheDensityForEveryConcentration) {
  for (const float kappa : {0.0f, 1e-6f, 0.5f, 8.0f, 400.0f, 2e4f, kMaxKappa}) {
    const Vmf lobe{kDirection, kappa};
    const auto sample = [&](const PathRandom& random) -> std::optional<Vec3> {
      return vmf::sample(lobe, random.get_2d(0, Event::kGuide));
    };
    // In the frame of the lobe, stretched so that its width is that of the sphere: t = 1 − cos θ is made uniform by its
    // own distribution function.
    const auto to_square = [&](const Vec3& w) -> Vec2 {
      const Frame frame(kDirection);
      const double t = 0.5 * length_squared(w - kDirection);
      const double u = kappa < 1e-5f ? t / 2 : std::expm1(-kappa * t) / std::expm1(-2.0 * kappa);
      const Vec3 local = frame.to_local(w);
      return {std::min(angle_turns(local.y, local.x), kOneMinusEpsilon),
              std::clamp(static_cast<float>(u), 0.0f, kOneMinusEpsilon)};
    };
    statistics::Chi2Options options;
    options.name = "vmf " + std::to_string(kappa);
    options.n_samples = 100000, options.n_cells = 64;
    const auto test = [&](auto density) {
      return statistics::chi2_square(
          [&](const PathRandom& random) -> std::optional<Vec2> { return to_square(*sample(random)); }, density,
          options);
    };
    const auto right = test([](const Vec2&) { return 1.0; });
    EXPECT_TRUE(right.accepted) << right.message;
    EXPECT_FALSE(test([](const Vec2& u) { return 0.9 + 0.2 * u.y; }).accepted) << kappa;
  }
}

TEST(Vmf, ConcentrationIsTheInverseOfTheMeanCosine) {
  for (const double kappa : {1e-3, 0.019, 0.021, 0.5, 3.0, 50.0, 1e4, 3e5})
    EXPECT_NEAR(vmf::kappa_of(vmf::one_minus_mean_cosine(kappa)) / kappa, 1, 1e-6) << kappa;
  EXPECT_EQ(vmf::kappa_of(1), 0);
  EXPECT_EQ(vmf::kappa_of(2), 0);
  EXPECT_EQ(vmf::kappa_of(0), kMaxKappa);
  EXPECT_EQ(vmf::kappa_of(std::nan("")), 0);
}

VmfMixture three_lobes() {
  VmfMixture mixture;
  mixture.lobes.n = 3;
  mixture.lobes.set(0, 0.5f, {kDirection, 20});
  mixture.lobes.set(1, 0.3f, {normalize(Vec3{-1, 1, 2}), 3});
  mixture.lobes.set(2, 0.2f, {{0, 0, -1}, 0});
  mixture.lobes.pad();
  return mixture;
}

TEST(VmfMixture, SamplesHaveTheDensity) {
  const VmfMixture mixture = three_lobes();
  for (const VmfLobes& lobes : {mixture.lobes, mixture.lobes.times_cosine(normalize(Vec3{1, 1, 1}))}) {
    const auto sample = [&](const PathRandom& random) -> std::optional<Vec3> {
      return lobes.sample(random.get_1d(0, Event::kTechnique), random.get_2d(0, Event::kGuide));
    };
    const auto right = statistics::chi2_sphere(sample, [&](const Vec3& w) { return lobes.pdf(w); });
    EXPECT_TRUE(right.accepted) << right.message;
    VmfLobes wrong = lobes;
    wrong.set(0, lobes.weight[0], {lobes.lobe(0).mean, lobes.kappa[0] * 1.1f});
    EXPECT_FALSE(statistics::chi2_sphere(sample, [&](const Vec3& w) { return wrong.pdf(w); }).accepted);
  }
}

TEST(VmfMixture, PartsAddUpToTheDensity) {
  const VmfLobes lobes = three_lobes().lobes;
  alignas(32) float parts[VmfLobes::kMax];
  const Vec3 w = normalize(Vec3{1, 2, 3});
  const float sum = lobes.pdfs(w, parts);
  EXPECT_EQ(sum, lobes.pdf(w));
  for (int k = 0; k < 3; ++k) EXPECT_NEAR(parts[k], lobes.weight[k] * vmf::pdf(lobes.lobe(k), w), 1e-6f);
}

TEST(VmfMixture, ProductWithTheCosineIsProportionalToTheProduct) {
  const VmfLobes lobes = three_lobes().lobes;
  const Vec3 normal = normalize(Vec3{0.2f, 0.5f, 0.8f});
  const VmfLobes product = lobes.times_cosine(normal);
  const Vmf cosine{normal, static_cast<float>(vmf::kappa_of(1 / 3.0))};
  const double norm = statistics::integrate_sphere([&](const Vec3& w) { return lobes.pdf(w) * vmf::pdf(cosine, w); });
  for (const Vec3& w : {normal, kDirection, Vec3{0, 0, 1}, Vec3{1, 0, 0}, Vec3{0, 0, -1}})
    EXPECT_NEAR(product.pdf(w) * norm / (lobes.pdf(w) * vmf::pdf(cosine, w)), 1, 1e-3);
  // With the true cosine: the fraction of directions above the horizon, and the overlap with the true product.
  const auto true_product = [&](const Vec3& w) { return lobes.pdf(w) * std::max(dot(w, normal), 0.0f); };
  const double true_norm = statistics::integrate_sphere(true_product);
  const auto distance = [&](const VmfLobes& l) {
    return 0.5 * statistics::integrate_sphere(
                     [&](const Vec3& w) { return std::abs(l.pdf(w) - true_product(w) / true_norm); }, 1e-4);
  };
  EXPECT_LT(distance(product), 0.17);
  EXPECT_GT(distance(lobes), 0.3);
}

TEST(VmfMixture, ProductIsFiniteForEveryLobe) {
  const Vec3 normal = {0, 0, 1};
  for (const float kappa : {0.0f, 1e-6f, 1.0f, kMaxKappa})
    for (const Vec3& mean : {normal, -normal, Vec3{1, 0, 0}}) {
      VmfLobes lobes;
      lobes.n = 1;
      lobes.set(0, 1, {mean, kappa});
      lobes.pad();
      const VmfLobes product = lobes.times_cosine(normal);
      EXPECT_NEAR(product.weight[0], 1, 1e-6);
      EXPECT_TRUE(std::isfinite(product.pdf(normal)) && std::isfinite(product.kappa[0]) && product.kappa[0] >= 0);
      EXPECT_NEAR(length(product.lobe(0).mean), 1, 1e-4);
    }
}

TEST(VmfMixture, LobesPointToTheirLightsFromEverywhere) {
  VmfMixture mixture = three_lobes();
  mixture.pivot = {1, 2, 3};
  mixture.inverse_distance[0] = 1 / 4.0f;  // a light at pivot + 4 kDirection; the others are infinitely far
  const Vec3 light = mixture.pivot + kDirection * 4, p = {2, 2, 2};
  const VmfLobes seen = mixture.at(p);
  EXPECT_NEAR(length(seen.lobe(0).mean - normalize(light - p)), 0, 1e-6);
  EXPECT_NEAR(length(seen.lobe(1).mean - mixture.lobes.lobe(1).mean), 0, 1e-6);
  const VmfMixture moved = mixture.moved_to(p);
  EXPECT_NEAR(1 / moved.inverse_distance[0], length(light - p), 1e-4);
  EXPECT_NEAR(length(moved.at(mixture.pivot).lobe(0).mean - kDirection), 0, 1e-6);
  for (const Vec3& w : {light - light, kDirection}) {  // at the light itself: any direction
    const Vec3 mean = mixture.at(light + w * 0.0f).lobe(0).mean;
    EXPECT_NEAR(length(mean), 1, 1e-5);
  }
}

TEST(VmfMixture, ChoosesOnlyLobesWithWeight) {
  VmfLobes lobes = three_lobes().lobes;
  lobes.weight[2] = 0, lobes.weight[0] = 0;
  EXPECT_EQ(lobes.choose(0), 1);
  EXPECT_EQ(lobes.choose(kOneMinusEpsilon), 1);
}

}  // namespace
}  // namespace covary
