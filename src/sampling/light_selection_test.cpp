// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_selection.h"

#include <gtest/gtest.h>

#include <limits>

#include "core/random.h"
#include "statistics/chi2.h"

namespace covary {
namespace {

/// An emitter with a power, known or estimated, and nothing else.
class PowerOnly final : public Emitter {
 public:
  explicit PowerOnly(float power, bool known = true) : power_(power), known_(known) {}
  EmitterSample sample_towards(const Vec3&, Vec2, float) const override { return {}; }
  EmissionSample sample_emission(Vec2, Vec2, float) const override { return {}; }
  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3&) const override { return {}; }
  Spectrum power() const override { return Spectrum(power_); }
  bool knows_power() const override { return known_; }

 private:
  float power_;
  bool known_;
};

std::unique_ptr<Scene> scene_of(std::initializer_list<float> powers, bool known = true) {
  SceneParts parts;
  for (const float power : powers) parts.emitters.push_back(std::make_shared<PowerOnly>(power, known));
  parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
  return std::make_unique<Scene>(std::move(parts));
}

std::vector<double> pmfs(const auto& lights, const Scene& scene) {
  std::vector<double> result;
  for (const auto& emitter : scene.emitters()) result.push_back(lights.pmf(*emitter));
  return result;
}

// N = 200 000 choices among the lights, alpha = 5e-7: with four lights, detects an error of 1.7 % rms in their
// probabilities with power 0.99.
statistics::Chi2Result test_choices(const auto& lights, const Scene& scene, const std::vector<double>& probabilities) {
  std::vector<double> observed(scene.emitters().size());
  for (int i = 0; i < 200000; ++i) {
    const float u = PathRandom(Sampling::kIndependent, 3, 0, 0, i).get_1d(1, Event::kLightChoice);
    for (size_t k = 0; k < observed.size(); ++k) observed[k] += scene.emitters()[k].get() == &lights.select(u);
  }
  return statistics::chi2_discrete(observed, probabilities, {.name = "lights"});
}

TEST(LightSelection, ChoosesWithTheProbabilityThatItTells) {
  const auto scene = scene_of({1, 0.5f, 8, 2.5f});
  const UniformLights uniform(*scene);
  const PowerLights by_power(*scene);
  EXPECT_EQ(pmfs(uniform, *scene), (std::vector<double>{0.25, 0.25, 0.25, 0.25}));
  const std::vector<double> expected = {1 / 12.0, 0.5 / 12, 8 / 12.0, 2.5 / 12}, told = pmfs(by_power, *scene);
  for (size_t k = 0; k < 4; ++k) EXPECT_NEAR(told[k], expected[k], 1e-6);

  const auto right = test_choices(uniform, *scene, pmfs(uniform, *scene));
  EXPECT_TRUE(right.accepted) << right.message;
  const auto right_by_power = test_choices(by_power, *scene, told);
  EXPECT_TRUE(right_by_power.accepted) << right_by_power.message;
  // Planted bugs: the probabilities of the other selection, and ones that are 3 % off.
  EXPECT_FALSE(test_choices(by_power, *scene, pmfs(uniform, *scene)).accepted);
  EXPECT_FALSE(test_choices(uniform, *scene, told).accepted);
  EXPECT_FALSE(test_choices(uniform, *scene, {0.2425, 0.2575, 0.2425, 0.2575}).accepted);
}

TEST(LightSelection, ALightWithoutPowerIsNotChosen) {
  const auto scene = scene_of({0, 3, 0});
  const PowerLights lights(*scene);
  EXPECT_EQ(pmfs(lights, *scene), (std::vector<double>{0, 1, 0}));
  for (const float u : {0.0f, 0.4f, kOneMinusEpsilon}) EXPECT_EQ(&lights.select(u), scene->emitters()[1].get());
}

TEST(LightSelection, ALightOfUnknownPowerIsUnlikelyButPossible) {
  const auto scene = scene_of({0, 3, 0}, false);
  const PowerLights lights(*scene);
  for (const size_t i : {0, 2}) EXPECT_NEAR(pmfs(lights, *scene)[i], 0.01 / 3.02, 1e-6);
}

TEST(LightSelection, ALightOfTinyPowerIsPossible) {
  const auto scene = scene_of({1, 1e-12f, 1});
  const PowerLights lights(*scene);
  EXPECT_GT(pmfs(lights, *scene)[1], 0);
  EXPECT_LT(pmfs(lights, *scene)[1], 1e-6);
}

TEST(LightSelection, PowersThatDoNotCompareGiveEqualChances) {
  const float infinity = std::numeric_limits<float>::infinity();
  for (const auto& powers : {std::initializer_list<float>{0, 0}, {1, infinity}, {2, std::nanf("")}}) {
    const auto scene = scene_of(powers);
    EXPECT_EQ(pmfs(PowerLights(*scene), *scene), (std::vector<double>{0.5, 0.5}));
  }
}

TEST(LightSelection, ThereMayBeNoLight) {
  const auto scene = scene_of({});
  EXPECT_TRUE(UniformLights(*scene).empty());
  EXPECT_TRUE(PowerLights(*scene).empty());
}

TEST(LightSelection, EveryNumberBelowOneChoosesALight) {
  const auto scene = scene_of({1, 1, 1, 1, 1, 1, 1});
  EXPECT_EQ(&UniformLights(*scene).select(0), scene->emitters().front().get());
  EXPECT_EQ(&UniformLights(*scene).select(kOneMinusEpsilon), scene->emitters().back().get());
  EXPECT_EQ(&PowerLights(*scene).select(kOneMinusEpsilon), scene->emitters().back().get());
}

}  // namespace
}  // namespace covary
