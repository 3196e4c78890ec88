// SPDX-License-Identifier: Apache-2.0
// `point` and `spot`: against Mitsuba 3 (tests/references/emitters.json) and closed forms.
#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <nlohmann/json.hpp>

#include "emitters/registry.h"
#include "support/describe.h"
#include "support/light_scene.h"
#include "textures/bitmap.h"

namespace covary {
namespace {

using namespace test_support;

const nlohmann::json& references() {
  static const nlohmann::json kAll = [] {
    std::ifstream file(COVARY_SOURCE_DIR "/tests/references/emitters.json");
    return nlohmann::json::parse(file);
  }();
  return kAll;
}

Vec3 vector(const nlohmann::json& v) { return {v[0].get<float>(), v[1].get<float>(), v[2].get<float>()}; }

void expect_towards(const Emitter& light, const nlohmann::json& expected) {
  EXPECT_TRUE(light.is_delta());
  for (size_t i = 0; i < references()["points"].size(); ++i) {
    const EmitterSample s = light.sample_towards(vector(references()["points"][i]), {0.3f, 0.7f}, 0.5f);
    EXPECT_TRUE(s.is_delta);
    EXPECT_EQ(s.pdf_solid_angle, 1);
    EXPECT_LT(length(s.wi - vector(expected[i]["d"])), 1e-6f);
    EXPECT_NEAR(s.distance, expected[i]["dist"].get<double>(), 1e-5);
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(s.radiance[c], expected[i]["weight"][c].get<double>(), 2e-5 * (1 + s.radiance[c])) << i;
  }
}

Made<Emitter> make(const std::string& type, const NamedValues& values) {
  return make_plugin<Emitter>(emitter_plugins(), "emitter", type, values);
}

TEST(PointLight, AgreesWithMitsuba) {
  const auto made = make("point", {{"position", Vec3{0.3f, -0.4f, 0.5f}}, {"intensity", ColourValue{{1, 2, 3}}}});
  ASSERT_EQ(made.errors, "");
  expect_towards(*made.object, references()["point"]);
}

TEST(PointLight, EmitsItsPowerInAllDirections) {
  const auto light = make("point", {{"to_world", Transform::translate({1, 2, 3})}}).object;
  const double power = luminance(light->power());
  EXPECT_NEAR(power, 4 * M_PI, 1e-5);
  const PathRandom random(Sampling::kIndependent, 1, 0, 0, 0);
  EXPECT_NEAR(power_estimate(*light, false, random), power, 1e-5);
  EXPECT_EQ(draw_emission(*light, random).ray.o, (Vec3{1, 2, 3}));
  EXPECT_TRUE(draw_emission(*light, random).delta_position);
  const auto result = statistics::chi2_sphere(
      [&](const PathRandom& r) -> std::optional<Vec3> { return draw_emission(*light, r).ray.d; },
      [&](const Vec3&) { return draw_emission(*light, random).pdf_direction; }, {.name = "point"});
  EXPECT_TRUE(result.accepted) << result.message;
}

TEST(PointLight, FailsToSampleFromItsOwnPosition) {
  const auto light = make("point", {}).object;
  EXPECT_EQ(light->sample_towards({0, 0, 0}, {}, 0).pdf_solid_angle, 0);
}

TEST(PointLight, TakesPositionOrToWorld) {
  EXPECT_EQ(make("point", {{"position", Vec3{}}, {"to_world", Transform()}}).errors,
            "test.xml:2:1: parameter 'position' of emitter 'point' cannot be combined with 'to_world'");
}

class Spot : public testing::TestWithParam<int> {
 protected:
  void SetUp() override {
    const auto& expected = references()["spot"][GetParam()];
    cutoff_ = expected["cutoff_angle"].get<double>();
    NamedValues values = {{"intensity", ColourValue{{1, 2, 3}}},
                          {"cutoff_angle", cutoff_},
                          {"to_world", Transform::look_at({0.1f, 0.2f, 3}, {0, 0, 0}, {0, 1, 0})}};
    if (!expected["beam_width"].is_null()) values.emplace_back("beam_width", expected["beam_width"].get<double>());
    Diagnostics diagnostics;
    GivenObjects objects(diagnostics);
    if (expected["textured"].get<bool>()) {
      const auto& stored = references()["spot_texture"];
      TexelImage image;
      image.width = stored["width"], image.height = stored["height"], image.channels = 3;
      image.floats = stored["pixels"].get<std::vector<float>>();
      values.emplace_back("texture", objects.nest("texture", make_bitmap_texture(image, {})));
    }
    const auto made = make_plugin<Emitter>(emitter_plugins(), "emitter", "spot", values, objects, diagnostics);
    ASSERT_EQ(made.errors, "");
    light_ = made.object;
  }
  double cutoff_;
  std::shared_ptr<Emitter> light_;
};

TEST_P(Spot, AgreesWithMitsuba) { expect_towards(*light_, references()["spot"][GetParam()]["towards"]); }

TEST_P(Spot, EmitsItsPowerInTheCone) {
  // Power of the textured light is a sum over a coarse grid, with an error below 0.5 %.
  const double power = luminance(light_->power());
  const bool textured = references()["spot"][GetParam()]["textured"].get<bool>();
  const auto estimate = [&](const PathRandom& r) { return power_estimate(*light_, false, r); };
  EXPECT_TRUE(mean_test(estimate, power, 200000, textured ? 5e-3 * power : 0).accepted);
  // Without a texture, and with a beam narrower than the cone, the estimate varies: a 2 % error must be detected.
  EXPECT_FALSE(
      mean_test([&](const PathRandom& r) { return 1.02 * estimate(r); }, power, 200000, textured ? 5e-3 * power : 0)
          .accepted);
  const Vec3 axis = normalize(Vec3{-0.1f, -0.2f, -3});
  const double cosine = std::cos(cutoff_ * M_PI / 180);
  const auto sampler = [&](const PathRandom& r) -> std::optional<Vec3> { return draw_emission(*light_, r).ray.d; };
  const auto pdf = [&](const Vec3& d) { return dot(d, axis) > cosine ? 1 / (2 * M_PI * (1 - cosine)) : 0; };
  // The density jumps at the edge of the cone, which the test's quadrature resolves to 1 %.
  const auto result = statistics::chi2_sphere(sampler, pdf, {.name = "spot", .mass_tolerance = 1e-2});
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_NEAR(draw_emission(*light_, PathRandom(Sampling::kIndependent, 1, 0, 0, 0)).pdf_direction, pdf(axis),
              1e-4 * pdf(axis));
}

TEST_P(Spot, IntensityIsThatOfEmittedRays) {
  for (int i = 0; i < 200; ++i) {
    const EmissionSample s = draw_emission(*light_, PathRandom(Sampling::kIndependent, 6, 0, 0, i));
    const EmitterSample back = light_->sample_towards(s.ray.at(2), {}, 0);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(back.radiance[c] * 4, s.radiance[c], 2e-3f);
  }
}

INSTANTIATE_TEST_SUITE_P(References, Spot, testing::Values(0, 1, 2));

/// The edges of KHR_lights_punctual ("angular attenuation") and of pbrt-v4 (lights.cpp, SpotLight::I, SmoothStep).
TEST(SpotLight, EdgesAreThoseOfOtherPrograms) {
  const double outer = 40 * M_PI / 180, inner = 25 * M_PI / 180, c = std::cos(outer), b = std::cos(inner);
  const std::pair<const char*, std::function<double(double)>> edges[] = {
      {"squared", [](double t) { return t * t; }}, {"smooth", [](double t) { return t * t * (3 - 2 * t); }}};
  for (const auto& [name, edge] : edges) {
    const auto light =
        make("spot", {{"cutoff_angle", 40.0}, {"beam_width", 25.0}, {"intensity", 3.0}, {"falloff", std::string(name)}})
            .object;
    double power = 0;
    constexpr int kSteps = 100000;
    for (int i = 0; i < kSteps; ++i) {
      const double z = 1 - (i + 0.5) * (1 - c) / kSteps;
      const double expected = 3 * edge(std::clamp((z - c) / (b - c), 0.0, 1.0));
      power += 2 * M_PI * expected * (1 - c) / kSteps;
      if (i % 1000 != 0) continue;
      const Vec3 from{0, static_cast<float>(2 * std::sqrt(1 - z * z)), static_cast<float>(2 * z)};
      EXPECT_NEAR(light->sample_towards(from, {}, 0).radiance.g * 4, expected, 1e-4) << name << " " << z;
    }
    EXPECT_NEAR(light->power().g, power, 1e-4 * power) << name;
  }
  EXPECT_NE(make("spot", {{"falloff", std::string("round")}}).errors, "");
}

TEST(SpotLight, ReportsWrongAngles) {
  EXPECT_EQ(make("spot", {{"cutoff_angle", 20.0}, {"beam_width", 30.0}}).errors,
            "test.xml:3:1: parameter 'beam_width' of emitter 'spot' must not exceed cutoff_angle");
  EXPECT_EQ(make("spot", {{"cutoff_angle", 0.0}}).errors,
            "test.xml:2:1: parameter 'cutoff_angle' of emitter 'spot' must lie between 0 and 180 degrees");
}

}  // namespace
}  // namespace covary
