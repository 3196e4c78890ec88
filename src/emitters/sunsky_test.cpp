// SPDX-License-Identifier: Apache-2.0
// `sunsky` against Mitsuba 3 (tests/references/emitters.json), and its sampling.
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "emitters/registry.h"
#include "emitters/sky_model.h"
#include "support/describe.h"
#include "support/light_scene.h"

namespace covary {
namespace {

using namespace test_support;

Made<Emitter> make(const NamedValues& values) {
  return make_plugin<Emitter>(emitter_plugins(), "emitter", "sunsky", values);
}

const nlohmann::json& references() {
  static const nlohmann::json kAll = [] {
    std::ifstream file(COVARY_SOURCE_DIR "/tests/references/emitters.json");
    return nlohmann::json::parse(file);
  }();
  return kAll;
}

Vec3 vector(const nlohmann::json& v) { return {v[0].get<float>(), v[1].get<float>(), v[2].get<float>()}; }

NamedValues values_of(const nlohmann::json& parameters) {
  NamedValues values;
  for (const auto& [name, value] : parameters.items())
    if (value.is_boolean())
      values.emplace_back(name, value.get<bool>());
    else if (value.is_number_integer())
      values.emplace_back(name, value.get<int64_t>());
    else if (value.is_number())
      values.emplace_back(name, value.get<double>());
    else
      values.emplace_back(name, ColourValue{{value["value"][0], value["value"][1], value["value"][2]}});
  return values;
}

Transform rotation() {
  const auto& r = references()["rotation"];
  return Transform::rotate(vector(r["axis"]), r["angle"].get<double>());
}

/// The light of an entry of references()["skies"], or only its sky.
std::shared_ptr<const Emitter> sky(nlohmann::json entry, bool alone = false) {
  if (alone) entry["parameters"]["sun_scale"] = 0.0;
  NamedValues values = values_of(entry["parameters"]);
  values.emplace_back("sun_direction", vector(entry["sun"]));
  if (entry["rotated"]) values.emplace_back("to_world", rotation());
  const auto made = make(values);
  EXPECT_EQ(made.errors, "");
  return made.object->in_scene({{-1, -2, -3}, {3, 2, 1}});
}

/// The largest error, relative to value + 0.01, over an entry's directions. Where a channel of the sun is negative,
/// only the sky remains: less than 0.2.
double largest_error(const nlohmann::json& entry, float scale = 1) {
  const auto light = sky(entry);
  double largest = 0;
  for (size_t i = 0; i < entry["directions"].size(); ++i) {
    const Spectrum value = light->environment(vector(entry["directions"][i])).radiance * scale;
    for (int c = 0; c < 3; ++c) {
      const double expected = entry["radiance"][i][c].get<double>();
      if (expected >= 0)
        largest = std::max(largest, std::abs(value[c] - expected) / (expected + 0.01));
      else
        EXPECT_LT(value[c], 0.2f);
    }
  }
  return largest;
}

TEST(SunSky, AgreesWithMitsuba) {
  ASSERT_EQ(references()["skies"].size(), 6u);
  for (const auto& entry : references()["skies"]) {
    // In Mitsuba's single precision the solid angle of the sun, 1 - cos, is up to 0.3 % off.
    const bool sun = !entry["parameters"].contains("albedo");
    EXPECT_LT(largest_error(entry), sun ? 5e-3 : 5e-4) << entry["parameters"];
    EXPECT_GT(largest_error(entry, 1.02f), 0.01) << entry["parameters"];  // planted
  }
}

/// Mitsuba counts days in single precision, in steps of a quarter of a day, which moves the sun by up to 0.2 degrees.
TEST(SunPosition, AgreesWithMitsubaWithinItsPrecision) {
  for (const auto& entry : references()["suns"]) {
    const auto& p = entry["parameters"];
    const auto value = [&](const char* name, auto fallback) { return p.value(name, fallback); };
    const Vec3 sun = sun_position({.latitude = value("latitude", 35.6894),
                                   .longitude = value("longitude", 139.6917),
                                   .timezone = value("timezone", 9.0),
                                   .year = value("year", 2010),
                                   .month = value("month", 7),
                                   .day = value("day", 10),
                                   .hour = value("hour", 15.0),
                                   .minute = value("minute", 0.0),
                                   .second = value("second", 0.0)});
    EXPECT_NEAR(length(sun), 1, 1e-6f);
    EXPECT_LT(length(sun - vector(entry["direction"])), 4e-3f) << p;
  }
}

/// Almanac: at the equinox of 20 March 2000, 07:35 UT, the sun crosses the equator; at the longitude where it is noon
/// (07:35 + 4.43 h, minus the equation of time of 7.5 minutes) it is at the zenith.
TEST(SunPosition, StandsInTheZenithAtTheEquinox) {
  const double noon = (12 - (7 + 35.0 / 60)) * 15 + 7.4 / 60 * 15;
  const Vec3 sun = sun_position({.latitude = 0,
                                 .longitude = noon,
                                 .timezone = 0,
                                 .year = 2000,
                                 .month = 3,
                                 .day = 20,
                                 .hour = 7,
                                 .minute = 35,
                                 .second = 0});
  EXPECT_GT(sun.z, std::cos(0.1 * M_PI / 180));
}

TEST(SunSky, SamplesWhatItClaims) {
  for (const size_t i : {0u, 2u, 4u, 5u}) {
    const auto light = sky(references()["skies"][i], true);
    const auto density = [&](const Vec3& d) { return light->environment(d).pdf_solid_angle; };
    const auto result = statistics::chi2_sphere(
        [&](const PathRandom& random) -> std::optional<Vec3> {
          const EmitterSample s = draw_towards(*light, {}, random);
          return s.pdf_solid_angle > 0 ? std::optional(s.wi) : std::nullopt;
        },
        density, {.name = "sunsky " + std::to_string(i)});
    EXPECT_TRUE(result.accepted) << result.message;
    const auto emitted = statistics::chi2_sphere(
        [&](const PathRandom& random) -> std::optional<Vec3> {
          const EmissionSample s = draw_emission(*light, random);
          return s.pdf_direction > 0 ? std::optional(s.ray.d) : std::nullopt;
        },
        [&](const Vec3& d) { return density(-d); }, {.name = "sunsky emission " + std::to_string(i)});
    EXPECT_TRUE(emitted.accepted) << emitted.message;
  }
}

/// The sun's part of the density: samples hit the disk with the claimed probability. N = 200 000, alpha = 5e-7 (five
/// standard deviations); detects 2 % of a probability of a half with power 0.99.
TEST(SunSky, SamplesTheSunAsOftenAsItClaims) {
  const auto& entry = references()["skies"][1];
  const auto light = sky(entry);
  const Vec3 sun = normalize(vector(entry["sun"]));
  const double cap = 2 * M_PI * (1 - std::cos(1.5 * M_PI / 180));
  const auto in_sun = [&](const PathRandom& random) {
    const EmitterSample s = draw_towards(*light, {}, random);
    EXPECT_NEAR(s.pdf_solid_angle, light->environment(s.wi).pdf_solid_angle, 1e-3f * s.pdf_solid_angle);
    return length(s.wi - sun) < 2 * std::sin(0.75 * M_PI / 180) ? 1.0 : 0.0;
  };
  const double claimed = light->environment(sun).pdf_solid_angle * cap;
  ASSERT_GT(claimed, 0.1);
  EXPECT_TRUE(mean_test(in_sun, claimed, 200000, 1e-3 * claimed).accepted);
  EXPECT_FALSE(mean_test(in_sun, 1.03 * claimed, 200000, 1e-3 * claimed).accepted);
}

/// Irradiance by sampling against quadrature of the sky alone, and power() against sampling, with a planted error of 2
/// %.
TEST(SunSky, WeightsAndPowerAreRight) {
  const auto clear = sky(references()["skies"][5]);
  const Vec3 n = normalize(Vec3{1, 1, 1});
  const double irradiance = statistics::integrate_sphere(
      [&](const Vec3& d) { return luminance(clear->environment(d).radiance) * std::max(0.0f, dot(d, n)); }, 1e-4);
  const auto estimate = [&](const PathRandom& random) { return irradiance_estimate(*clear, {}, n, random); };
  EXPECT_TRUE(mean_test(estimate, irradiance, 200000, 3e-4 * irradiance).accepted);
  EXPECT_FALSE(mean_test([&](const PathRandom& r) { return 1.02 * estimate(r); }, irradiance, 200000, 3e-4 * irradiance)
                   .accepted);
  for (const auto& entry : references()["skies"]) {
    const auto light = sky(entry);
    const double power = luminance(light->power());
    EXPECT_TRUE(
        mean_test([&](const PathRandom& r) { return power_estimate(*light, false, r); }, power, 200000, 4e-3 * power)
            .accepted)
        << entry["parameters"];
  }
}

/// The sun's irradiance is independent of the width of its disk.
TEST(SunSky, ApertureKeepsTheSunsLight) {
  const auto power = [](double aperture) {
    const auto made = make({{"sky_scale", 0.0}, {"sun_aperture", aperture}, {"sun_direction", Vec3{0, 0.6f, 0.8f}}});
    return luminance(made.object->power());
  };
  EXPECT_NEAR(power(10) / power(0.5358), 1, 1e-4);
}

TEST(SunSky, IsBlackAtNight) {
  const auto made = make({{"hour", 1.0}});
  EXPECT_EQ(made.errors, "");
  EXPECT_EQ(made.object->environment({0, 0, 1}).radiance, Spectrum(0));
  EXPECT_EQ(made.object->power(), Spectrum(0));
  EXPECT_EQ(made.object->sample_towards({}, {0.3f, 0.4f}, 0.5f).pdf_solid_angle, 0);
  const auto off = make({{"sun_scale", 0.0}, {"sky_scale", 0.0}});
  EXPECT_EQ(off.object->power(), Spectrum(0));
}

TEST(SunSky, WrongParametersAreNamed) {
  const auto made = make({{"turbidity", 11.0},
                          {"sun_direction", Vec3{0, 0, 1}},
                          {"month", int64_t{13}},
                          {"to_world", Transform::scale({1, 2, 1})},
                          {"sun_aperture", 0.0}});
  for (const char* message :
       {"test.xml:2:1: parameter 'turbidity' of emitter 'sunsky' is 11; it must lie in [1, 10]",
        "test.xml:3:1: parameter 'sun_direction' of emitter 'sunsky' cannot be combined with a place and time",
        "test.xml:4:1: parameter 'month' of emitter 'sunsky' is 13",
        "test.xml:5:1: parameter 'to_world' of emitter 'sunsky' distorts directions",
        "test.xml:6:1: parameter 'sun_aperture' of emitter 'sunsky' is 0"})
    EXPECT_NE(made.errors.find(message), std::string::npos) << message << "\nnot in\n" << made.errors;
}

}  // namespace
}  // namespace covary
