// SPDX-License-Identifier: Apache-2.0
#include "sampling/vmf_fit.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "core/random.h"

namespace covary {
namespace {

VmfMixture planted(const std::vector<std::pair<float, Vmf>>& lobes) {
  VmfMixture mixture;
  for (const auto& [weight, lobe] : lobes) mixture.lobes.set(mixture.lobes.n++, weight, lobe);
  mixture.lobes.pad();
  return mixture;
}

const VmfMixture& three_planted() {
  static const VmfMixture mixture = planted(
      {{0.5f, {{0, 0, 1}, 100}}, {0.3f, {normalize(Vec3{1, 0, 0.2f}), 1000}}, {0.2f, {normalize(Vec3{-1, 1, -1}), 4}}});
  return mixture;
}

/// Directions from another density, with weights that make them samples of the mixture.
std::vector<GuidingSample> samples_of(const VmfMixture& mixture, size_t n, uint64_t seed = 1) {
  std::vector<GuidingSample> samples;
  for (size_t i = 0; i < n; ++i) {
    const PathRandom random(Sampling::kIndependent, seed, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kGuide);
    const bool uniform = random.get_1d(0, Event::kLobe) < 0.3f;
    const Vec3 w = uniform ? vmf::sample(Vmf(), u) : mixture.lobes.sample(random.get_1d(0, Event::kTechnique), u);
    const float target = mixture.lobes.pdf(w), pdf = 0.3f * vmf::pdf(Vmf(), w) + 0.7f * target;
    samples.push_back({.position = {}, .direction = w, .weight = 5 * target / pdf, .pdf = pdf});
  }
  return samples;
}

/// Kullback-Leibler divergence of `mixture` from `truth`, estimated by samples of `truth`.
double divergence(const VmfLobes& truth, const VmfLobes& mixture) {
  double sum = 0;
  const int n = 20000;
  for (int i = 0; i < n; ++i) {
    const PathRandom random(Sampling::kIndependent, 99, 0, 0, static_cast<uint64_t>(i));
    const Vec3 w = truth.sample(random.get_1d(0, Event::kTechnique), random.get_2d(0, Event::kGuide));
    sum += std::log(truth.pdf(w) / mixture.pdf(w)) / n;
  }
  return sum;
}

TEST(VmfFit, RecoversPlantedMixtures) {
  const std::vector<GuidingSample> samples = samples_of(three_planted(), 20000);
  VmfMixture mixture = VmfFit(samples, {}, {}).fit();
  EXPECT_LT(divergence(three_planted().lobes, mixture.lobes), 0.02);
  EXPECT_GT(divergence(three_planted().lobes, uniform_lobes(16, 5, {}).lobes), 0.5);
  // With as many lobes as were planted, each started nearby, the fit recovers the planted ones.
  VmfFitSettings three;
  three.n_lobes = three.max_lobes = 3, three.split_above = 1e9, three.merge_below = 0, three.tolerance = 1e-7;
  mixture = VmfFit(samples, {}, three)
                .fit(planted({{0.33f, {normalize(Vec3{-0.3f, 0.3f, 1}), 10}},
                              {0.33f, {normalize(Vec3{1, 0.3f, 0}), 10}},
                              {0.34f, {normalize(Vec3{0, 1, -1}), 10}}}));
  for (int k = 0; k < 3; ++k) {
    const Vmf truth = three_planted().lobes.lobe(k);
    int nearest = 0;
    for (int j = 1; j < 3; ++j)
      if (dot(mixture.lobes.lobe(j).mean, truth.mean) > dot(mixture.lobes.lobe(nearest).mean, truth.mean)) nearest = j;
    EXPECT_NEAR(mixture.lobes.weight[nearest], three_planted().lobes.weight[k], 0.02);
    EXPECT_NEAR(mixture.lobes.kappa[nearest] / truth.kappa, 1, 0.1);
    EXPECT_GT(dot(mixture.lobes.lobe(nearest).mean, truth.mean), 0.997f);
  }
}

TEST(VmfFit, StepsNeverLowerTheLikelihood) {
  const std::vector<GuidingSample> samples = samples_of(three_planted(), 3000);
  for (const double prior : {0.0, 0.2, 5.0})
    for (const float kappa : {0.5f, 5.0f, 500.0f}) {
      VmfFitSettings settings;
      settings.mean_cosine_prior = prior;
      const VmfFit fit(samples, {}, settings);
      VmfMixture mixture = uniform_lobes(16, kappa, {});
      double before = -1e30;
      for (int i = 0; i < 60; ++i) {
        const double now = fit.step(mixture);
        EXPECT_GE(now, before - 1e-5 * std::abs(before)) << prior << " " << kappa << " step " << i;
        before = now;
      }
    }
}

TEST(VmfFit, MergesLobesThatAreOne) {
  VmfMixture mixture =
      planted({{0.4f, {{0, 0, 1}, 50}}, {0.3f, {normalize(Vec3{0.01f, 0, 1}), 48}}, {0.3f, {{1, 0, 0}, 50}}});
  mixture.inverse_distance[0] = mixture.inverse_distance[1] = 0.5f;
  const std::vector<GuidingSample> samples = samples_of(mixture, 100);
  EXPECT_EQ(VmfFit(samples, {}, {}).merge(mixture), 1);
  EXPECT_EQ(mixture.lobes.n, 2);
  EXPECT_NEAR(mixture.lobes.weight[0], 0.7f, 1e-6);
  EXPECT_NEAR(mixture.lobes.kappa[0], 49, 1);
  EXPECT_EQ(mixture.inverse_distance[0], 0.5f);
}

TEST(VmfFit, SplitsALobeThatHidesTwo) {
  const VmfMixture two =
      planted({{0.5f, {normalize(Vec3{0.3f, 0, 1}), 400}}, {0.5f, {normalize(Vec3{-0.3f, 0, 1}), 400}}});
  const std::vector<GuidingSample> samples = samples_of(two, 10000);
  VmfFitSettings settings;
  const VmfFit fit(samples, {}, settings);
  VmfMixture mixture = planted({{1, {{0, 0, 1}, 20}}});
  EXPECT_EQ(fit.split(mixture), 1);
  fit.converge(mixture);
  EXPECT_EQ(mixture.lobes.n, 2);
  EXPECT_LT(divergence(two.lobes, mixture.lobes), 0.01);
  EXPECT_EQ(fit.split(mixture), 0);
}

/// Samples seen from points spread over a square, lit by a small light above it.
std::vector<GuidingSample> near_light(size_t n, bool with_distance) {
  const Vec3 light = {0, 0, 1};
  std::vector<GuidingSample> samples;
  for (size_t i = 0; i < n; ++i) {
    const PathRandom random(Sampling::kIndependent, 5, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kLens), v = random.get_2d(0, Event::kPixel);
    const Vec3 p = {2 * u.x - 1, 2 * u.y - 1, 0};
    const Vec3 d = light + Vec3{0.1f * v.x - 0.05f, 0.1f * v.y - 0.05f, 0} - p;
    samples.push_back({.position = p,
                       .direction = normalize(d),
                       .inverse_distance = with_distance ? 1 / length(d) : 0,
                       .weight = 1,
                       .pdf = 100});
  }
  return samples;
}

TEST(VmfFit, ParallaxFollowsANearLight) {
  const Vec3 corner = {0.8f, -0.8f, 0}, to_light = normalize(Vec3{0, 0, 1} - corner);
  const VmfMixture with = VmfFit(near_light(5000, true), {}, {}).fit();
  const VmfMixture without = VmfFit(near_light(5000, false), {}, {}).fit();
  std::vector<GuidingSample> at_corner = near_light(5000, true);
  for (GuidingSample& s : at_corner) {
    const Vec3 d = s.position + s.direction * (1 / s.inverse_distance) - corner;
    s = {.position = corner, .direction = normalize(d), .inverse_distance = 1 / length(d), .weight = 1, .pdf = 100};
  }
  const double best = VmfFit(at_corner, corner, {}).fit().lobes.pdf(to_light);
  EXPECT_GT(with.at(corner).pdf(to_light), 0.25 * best);
  EXPECT_LT(without.at(corner).pdf(to_light), 0.1 * best);
}

void expect_valid(const VmfMixture& mixture, const std::string& what) {
  double sum = 0;
  for (int k = 0; k < mixture.lobes.n; ++k) {
    sum += mixture.lobes.weight[k];
    EXPECT_TRUE(mixture.lobes.kappa[k] >= 0 && mixture.lobes.kappa[k] <= kMaxKappa) << what;
    EXPECT_NEAR(length(mixture.lobes.lobe(k).mean), 1, 1e-4) << what;
    EXPECT_TRUE(std::isfinite(mixture.inverse_distance[k])) << what;
  }
  EXPECT_NEAR(sum, 1, 1e-4) << what;
}

TEST(VmfFit, DegenerateInputsAreDefined) {
  const GuidingSample one = {.position = {}, .direction = {0, 0, 1}, .weight = 3, .pdf = 0.1f};
  GuidingSample dark = one, huge = one, tiny = one;
  dark.weight = 0, huge.weight = 1e30f, tiny.weight = 1e-30f;
  EXPECT_EQ(VmfFit(std::vector{dark, dark}, {}, {}).fit().lobes.n, 0);
  EXPECT_EQ(VmfFit({}, {}, {}).fit().lobes.n, 0);
  expect_valid(VmfFit(std::vector{one}, {}, {}).fit(), "one sample");
  expect_valid(VmfFit(std::vector{tiny}, {}, {}).fit(), "one sample of tiny weight");

  const std::vector<GuidingSample> same(1000, one);
  const VmfMixture narrow = VmfFit(same, {}, {}).fit();
  expect_valid(narrow, "all in one direction");
  EXPECT_GT(narrow.lobes.pdf({0, 0, 1}), 100);

  // One sample with nearly all the weight must not become a needle-thin lobe.
  std::vector<GuidingSample> outlier = samples_of(three_planted(), 1000);
  outlier.push_back(huge);
  const VmfMixture mixture = VmfFit(outlier, {}, {}).fit();
  expect_valid(mixture, "an outlier");
  EXPECT_LT(mixture.lobes.pdf({0, 0, 1}), 10);

  // Positions at the light itself, from which no direction leads to it.
  GuidingSample at_light = one;
  at_light.inverse_distance = 1, at_light.position = {0, 0, -1};
  expect_valid(VmfFit(std::vector{at_light}, {0, 0, 0}, {}).fit(), "pivot at the light");
}

}  // namespace
}  // namespace covary
