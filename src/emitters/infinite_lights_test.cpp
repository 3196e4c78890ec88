// SPDX-License-Identifier: Apache-2.0
// `constant`, `envmap` and `directional`: against closed forms and against Mitsuba 3 (tests/references/emitters.json).
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "emitters/registry.h"
#include "support/describe.h"
#include "support/files.h"
#include "support/light_scene.h"

namespace covary {
namespace {

using namespace test_support;

Made<Emitter> make(const std::string& type, const NamedValues& values) {
  return make_plugin<Emitter>(emitter_plugins(), "emitter", type, values);
}

const nlohmann::json& references() {
  static const nlohmann::json kAll = [] {
    std::ifstream file(COVARY_SOURCE_DIR "/tests/references/emitters.json");
    return nlohmann::json::parse(file);
  }();
  return kAll;
}

Vec3 vector(const nlohmann::json& v) { return {v[0].get<float>(), v[1].get<float>(), v[2].get<float>()}; }

void write_exr(const std::string& path, const nlohmann::json& image) {
  const auto output = OIIO::ImageOutput::create(path);
  OIIO::ImageSpec spec(image["width"], image["height"], 3, OIIO::TypeDesc::FLOAT);
  ASSERT_TRUE(output && output->open(path, spec));
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, image["pixels"].get<std::vector<float>>().data()));
  ASSERT_TRUE(output->close());
}

/// A small version of the sun map in environment_image_test, as a file.
std::shared_ptr<Emitter> sun(const TemporaryFolder& folder) {
  nlohmann::json image = {{"width", 12}, {"height", 7}, {"pixels", std::vector<float>(12 * 7 * 3, 0.3f)}};
  for (int c = 0; c < 3; ++c) image["pixels"][3 * (12 * 2 + 5) + c] = 200.0f + 100 * c;
  write_exr(folder.file("sun.exr"), image);
  return make("envmap", {{"filename", folder.file("sun.exr")}, {"to_world", Transform::rotate({1, 2, 3}, 40)}}).object;
}

const Bounds3 kBounds = {{-1, -2, -3}, {3, 2, 1}};
const Vec3 kCenter = kBounds.center();

/// Rays must start on the disk that touches the scene's sphere, uniformly, and enter the scene.
void expect_rays_cover_the_scene(const Emitter& emitter) {
  const double radius = kBounds.radius();
  const auto on_disk = [&](const PathRandom& random) -> std::optional<Vec2> {
    const EmissionSample s = draw_emission(emitter, random);
    const Vec3 offset = s.ray.o - kCenter;
    EXPECT_NEAR(dot(offset, s.ray.d), -radius, 1e-4 * radius);
    EXPECT_NEAR(s.pdf_position, 1 / (M_PI * radius * radius), 1e-6);
    const Vec3 local = Frame(s.ray.d).to_local(offset) * static_cast<float>(1 / radius);
    // Area-preserving map from the disk to the unit square.
    const float phi = std::atan2(local.y, local.x) / kTwoPi;
    return Vec2{std::min(local.x * local.x + local.y * local.y, kOneMinusEpsilon),
                std::min(phi < 0 ? phi + 1 : phi, kOneMinusEpsilon)};
  };
  const auto result = statistics::chi2_square(on_disk, [](const Vec2&) { return 1.0; }, {.name = "disk"});
  EXPECT_TRUE(result.accepted) << result.message;
  const auto wrong = statistics::chi2_square(  // planted: radius uniform instead of its square
      [&](const PathRandom& random) -> std::optional<Vec2> {
        const Vec2 uv = *on_disk(random);
        return Vec2{std::sqrt(uv.x), uv.y};
      },
      [](const Vec2&) { return 1.0; }, {.name = "disk, planted", .n_samples = 50000});
  EXPECT_FALSE(wrong.accepted);
}

TEST(ConstantLight, SamplesTheSphereUniformlyAndLightsItEvenly) {
  const auto light = make("constant", {{"radiance", ColourValue{{1, 2, 3}}}}).object->in_scene(kBounds);
  EXPECT_TRUE(light->is_environment());
  EXPECT_EQ(light->environment({0, 1, 0}).radiance, Spectrum(1, 2, 3));
  const double radiance = luminance({1, 2, 3});
  const auto result = statistics::chi2_sphere(
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_towards(*light, {}, random).wi; },
      [&](const Vec3& d) { return light->environment(d).pdf_solid_angle; }, {.name = "constant"});
  EXPECT_TRUE(result.accepted) << result.message;
  const auto irradiance = [&](const PathRandom& random) { return irradiance_estimate(*light, {}, {0, 1, 0}, random); };
  EXPECT_TRUE(mean_test(irradiance, M_PI * radiance).accepted);
  EXPECT_FALSE(mean_test([&](const PathRandom& r) { return 1.02 * irradiance(r); }, M_PI * radiance).accepted);
  // Every emitted ray carries the same power: pi r^2 4 pi L.
  const double power = luminance(light->power()), r2 = kBounds.radius() * kBounds.radius();
  EXPECT_NEAR(power, 4 * M_PI * M_PI * r2 * radiance, 1e-5 * power);
  for (int i = 0; i < 100; ++i)
    EXPECT_NEAR(power_estimate(*light, false, PathRandom(Sampling::kIndependent, 1, 0, 0, i)), power, 1e-5 * power);
  expect_rays_cover_the_scene(*light);
}

TEST(DirectionalLight, AgreesWithMitsubaAndCoversTheScene) {
  const auto light =
      make("directional", {{"direction", Vec3{0.3f, -0.4f, 0.5f}}, {"irradiance", ColourValue{{1, 2, 3}}}})
          .object->in_scene(kBounds);
  EXPECT_TRUE(light->is_delta());
  const EmitterSample s = light->sample_towards({1, 2, 3}, {0.1f, 0.2f}, 0.3f);
  const auto& expected = references()["directional"][0];
  EXPECT_LT(length(s.wi - vector(expected["d"])), 1e-6f);
  EXPECT_EQ(s.radiance, Spectrum(1, 2, 3));
  EXPECT_EQ(expected["weight"], (nlohmann::json{1.0, 2.0, 3.0}));
  EXPECT_TRUE(s.is_delta);
  EXPECT_EQ(s.pdf_solid_angle, 1);
  EXPECT_EQ(s.distance, kInfinity);
  const double power = luminance(light->power());
  EXPECT_NEAR(power, M_PI * kBounds.radius() * kBounds.radius() * luminance({1, 2, 3}), 1e-5 * power);
  EXPECT_NEAR(power_estimate(*light, false, PathRandom(Sampling::kIndependent, 1, 0, 0, 0)), power, 1e-5 * power);
  expect_rays_cover_the_scene(*light);
}

TEST(DirectionalLight, TakesToWorldOrDirection) {
  const auto light = make("directional", {{"to_world", Transform::look_at({0, 0, 0}, {0, -2, 0}, {1, 0, 0})}}).object;
  EXPECT_LT(length(light->sample_towards({}, {}, 0).wi - Vec3{0, 1, 0}), 1e-6f);
  EXPECT_EQ(make("directional", {{"to_world", Transform()}, {"direction", Vec3{0, 0, 1}}}).errors,
            "test.xml:3:1: parameter 'direction' of emitter 'directional' cannot be combined with 'to_world'");
  EXPECT_EQ(make("directional", {{"direction", Vec3{0, 0, 0}}}).errors,
            "test.xml:2:1: parameter 'direction' of emitter 'directional' has length zero");
}

TEST(EnvironmentMap, AgreesWithMitsuba) {
  const TemporaryFolder folder;
  const auto& all = references();
  const Transform rotation = Transform::rotate(vector(all["rotation"]["axis"]), all["rotation"]["angle"].get<double>());
  for (const auto& expected : all["envmap"]) {
    write_exr(folder.file("e.exr"), expected);
    Transform to_world;
    if (expected["to_world"] != "none") to_world = rotation;
    if (expected["to_world"] == "mirrored") to_world = rotation * Transform::scale({-1, 1, 1});
    const auto made = make("envmap", {{"filename", folder.file("e.exr")}, {"scale", 1.5}, {"to_world", to_world}});
    ASSERT_EQ(made.errors, "");
    for (size_t i = 0; i < all["directions"].size(); ++i) {
      const Vec3 d = vector(all["directions"][i]);
      const Spectrum value = made.object->environment(d).radiance;
      // Mitsuba's acos is imprecise near the poles: 3e-4 rad, times rows and values up to 15.
      const double tolerance = std::abs(d.y) > 0.999f ? 3e-2 : 2e-4;
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(value[c], expected["radiance"][i][c].get<double>(), tolerance)
            << expected["width"] << " x " << expected["height"] << " " << expected["to_world"] << " direction " << d.x
            << " " << d.y << " " << d.z;
    }
  }
}

TEST(EnvironmentMap, SamplesWhatItClaimsInWorldSpace) {
  const TemporaryFolder folder;
  const auto light = sun(folder)->in_scene(kBounds);
  const auto result = statistics::chi2_sphere(
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_towards(*light, {}, random).wi; },
      [&](const Vec3& d) { return light->environment(d).pdf_solid_angle; }, {.name = "envmap"});
  EXPECT_TRUE(result.accepted) << result.message;
  const auto emitted = statistics::chi2_sphere(
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_emission(*light, random).ray.d; },
      [&](const Vec3& d) { return light->environment(-d).pdf_solid_angle; }, {.name = "envmap emission"});
  EXPECT_TRUE(emitted.accepted) << emitted.message;
  const auto wrong = statistics::chi2_sphere(  // planted: the rotation forgotten
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_towards(*light, {}, random).wi; },
      [&](const Vec3& d) {
        return light->environment(Transform::rotate({1, 2, 3}, 40).vector(d)).pdf_solid_angle;
      },
      {.name = "envmap, planted", .n_samples = 50000});
  EXPECT_FALSE(wrong.accepted);

  const Vec3 n = normalize(Vec3{1, 1, -1});
  const double irradiance = statistics::integrate_sphere(
      [&](const Vec3& d) { return luminance(light->environment(d).radiance) * std::max(0.0f, dot(d, n)); }, 1e-4);
  const auto estimate = [&](const PathRandom& random) { return irradiance_estimate(*light, {}, n, random); };
  EXPECT_TRUE(mean_test(estimate, irradiance, 200000, 2e-4 * irradiance).accepted);
  EXPECT_FALSE(mean_test([&](const PathRandom& r) { return 1.05 * estimate(r); }, irradiance, 200000, 2e-4 * irradiance)
                   .accepted);
  const double power = luminance(light->power());
  EXPECT_TRUE(mean_test([&](const PathRandom& r) { return power_estimate(*light, false, r); }, power).accepted);
  expect_rays_cover_the_scene(*light);
}

/// Two maps and a constant: radiances add up, and each direction has the density of all that may choose it.
TEST(Environments, SampleTheSumOfTheirParts) {
  const TemporaryFolder folder;
  const std::shared_ptr<const Emitter> map = sun(folder), even = make("constant", {}).object;
  const auto sum_of = [&](const std::vector<std::shared_ptr<const Emitter>>& parts) {
    Diagnostics diagnostics;
    GivenObjects objects(diagnostics);
    NamedValues values;
    for (const auto& part : parts) values.emplace_back("", objects.nest("emitter", part));
    return make_plugin<Emitter>(emitter_plugins(), "emitter", "environments", values, objects, diagnostics);
  };
  const auto light = sum_of({map, even, map}).object->in_scene(kBounds);
  const auto placed = map->in_scene(kBounds), constant = even->in_scene(kBounds);
  EXPECT_TRUE(light->is_environment());
  for (const Vec3& d : {Vec3{0, 1, 0}, normalize(Vec3{1, 2, -3}), Vec3{-1, 0, 0}})
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(light->environment(d).radiance[c], 2 * map->environment(d).radiance[c] + 1, 1e-4f);
  const double power = luminance(light->power());
  EXPECT_NEAR(power, luminance(2.0f * placed->power() + constant->power()), 1e-5 * power);
  EXPECT_TRUE(mean_test([&](const PathRandom& r) { return power_estimate(*light, false, r); }, power).accepted);
  const auto result = statistics::chi2_sphere(
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_towards(*light, {}, random).wi; },
      [&](const Vec3& d) { return light->environment(d).pdf_solid_angle; }, {.name = "environments"});
  EXPECT_TRUE(result.accepted) << result.message;
  const auto emitted = statistics::chi2_sphere(
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_emission(*light, random).ray.d; },
      [&](const Vec3& d) { return light->pdf_emission({}, d).direction; }, {.name = "environments, emission"});
  EXPECT_TRUE(emitted.accepted) << emitted.message;
  const auto wrong = statistics::chi2_sphere(  // planted: one part alone
      [&](const PathRandom& random) -> std::optional<Vec3> { return draw_towards(*light, {}, random).wi; },
      [&](const Vec3& d) { return map->environment(d).pdf_solid_angle; }, {.name = "planted", .n_samples = 50000});
  EXPECT_FALSE(wrong.accepted);
  expect_rays_cover_the_scene(*light);
  EXPECT_NE(light->mis_compensated(), nullptr);
  EXPECT_EQ(sum_of({even, even}).object->mis_compensated(), nullptr);
  EXPECT_EQ(sum_of({}).errors, "test.xml:1:1: emitter 'environments': holds no emitters");
  EXPECT_NE(sum_of({make("point", {}).object}).errors.find("does not shine from all around"), std::string::npos);
}

TEST(EnvironmentMap, ReportsWrongParameters) {
  const TemporaryFolder folder;
  std::ofstream(folder.file("a.hdr")) << "nothing";
  const auto made = make("envmap", {{"filename", folder.file("a.hdr")},
                                    {"scale", -1.0},
                                    {"to_world", Transform::scale({1, 2, 1})},
                                    {"file_name", std::string("x")}});
  EXPECT_EQ(made.object, nullptr);
  for (const char* message :
       {"test.xml:2:1: parameter 'filename' of emitter 'envmap' cannot be used: ",
        "test.xml:3:1: parameter 'scale' of emitter 'envmap' is -1; it must be at least 0",
        "test.xml:4:1: parameter 'to_world' of emitter 'envmap' distorts directions",
        "test.xml:5:1: unknown parameter 'file_name' of emitter 'envmap'; did you mean 'filename'?"})
    EXPECT_NE(made.errors.find(message), std::string::npos) << message << "\nnot in\n" << made.errors;
}

}  // namespace
}  // namespace covary
