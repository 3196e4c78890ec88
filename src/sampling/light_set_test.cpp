// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_set.h"

#include <gtest/gtest.h>

#include "emitters/registry.h"
#include "scene/analytic_shape.h"
#include "scene/mesh.h"
#include "support/describe.h"
#include "support/light_scene.h"
#include "textures/bitmap.h"

namespace covary {
namespace {

using namespace test_support;

/// Triangles over the square [0, 1]^2 at height z with the given first corners; areas 1/2 and 1/8.
std::shared_ptr<TriangleMesh> two_triangles(float z) {
  MeshData data;
  for (const Vec3& p : {Vec3{0, 0, z}, {0, 1, z}, {1, 0, z}, {2, 0, z}, {2, 0.5f, z}, {2.5f, 0, z}})
    data.positions.push_back(p);
  data.triangles = {{0, 1, 2}, {3, 4, 5}};
  return std::make_shared<TriangleMesh>(std::move(data));
}

std::shared_ptr<TriangleMesh> parallelogram(float z) {
  MeshData data;
  for (const Vec3& p : {Vec3{-3, 0, z}, {-2, 0, z}, {-2, 1, z}, {-3, 1, z}}) data.positions.push_back(p);
  data.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  data.triangles = {{1, 0, 2}, {3, 2, 0}};
  return std::make_shared<TriangleMesh>(std::move(data));
}

/// A mesh of two triangles, a parallelogram, a sphere, a point light and an environment, all seen from below.
struct ManyLights {
  ManyLights() {
    const auto add = [&](std::shared_ptr<Shape> shape, const Spectrum& radiance) {
      auto light = std::make_shared<AreaLight>(std::make_shared<ConstantTexture>(radiance));
      light->attach(shape.get());
      shape->set_emitter(light);
      shape->set_bsdf(std::make_shared<BlackBsdf>());
      parts.shapes.push_back(std::move(shape));
      parts.emitters.push_back(light);
    };
    add(two_triangles(2), Spectrum(4));
    add(parallelogram(2), {0, 0, 3});
    parts.emitters.push_back(make_plugin<Emitter>(emitter_plugins(), "emitter", "constant", {}).object);
    add(std::make_shared<Sphere>(Transform(), Vec3{0, -3, 3}, 0.5f, false), Spectrum(2));
    parts.emitters.push_back(make_plugin<Emitter>(emitter_plugins(), "emitter", "point", {}).object);
    parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
    scene = std::make_unique<Scene>(std::move(parts));
  }
  SceneParts parts;
  std::unique_ptr<Scene> scene;
};

constexpr uint32_t kTriangles = 0, kParallelogram = 2, kSphere = 3, kPoint = 4;

TEST(LightSet, NumbersTrianglesParallelogramsShapesAndPointsButNoEnvironment) {
  const ManyLights lights;
  const LightSet set(*lights.scene, LightSelection::kShape);
  ASSERT_EQ(set.size(), 5u);
  EXPECT_EQ(set[1].emitter, set[0].emitter);
  EXPECT_EQ(set[1].part, 1u);
  EXPECT_TRUE(set[kPoint].emitter->is_delta());
}

TEST(LightSet, SelectsByTriangleShapeOrPower) {
  const ManyLights lights;
  const auto expect = [&](LightSelection selection, std::vector<double> weights) {
    const LightSet set(*lights.scene, selection);
    double sum = 0, total = 0;
    for (const double weight : weights) sum += weight;
    for (uint32_t i = 0; i < set.size(); ++i) {
      EXPECT_NEAR(set[i].pmf, weights[i] / sum, 1e-6) << name_of(selection) << ' ' << i;
      total += set[i].pmf;
    }
    EXPECT_EQ(total, 1);
  };
  expect(LightSelection::kTriangle, {1, 1, 2, 1, 1});
  expect(LightSelection::kShape, {0.8, 0.2, 1, 1, 1});
  expect(LightSelection::kPower, {kPi * 4 / 2, kPi * 4 / 8, kPi, kPi * 2 * 4 * kPi * 0.25, 4 * kPi});
}

TEST(LightSet, SelectsWithExactlyTheProbabilitiesItSays) {
  const ManyLights lights;
  const LightSet set(*lights.scene, LightSelection::kPower);
  std::vector<uint32_t> counts(set.size());
  for (uint32_t i = 0; i < 1u << 24; ++i) ++counts[set.select(static_cast<float>(i) * 0x1p-24f)];
  for (uint32_t i = 0; i < set.size(); ++i) EXPECT_EQ(static_cast<float>(counts[i]) * 0x1p-24f, set[i].pmf) << i;
}

TEST(LightSet, FindsNumberAndDensityOfASampleAtItsHit) {
  const ManyLights lights;
  const LightSet set(*lights.scene, LightSelection::kTriangle);
  const Vec3 reference = {0.1f, -0.2f, 0};
  for (uint32_t number : {kTriangles, kTriangles + 1, kParallelogram, kSphere})
    for (int i = 0; i < 50; ++i) {
      const PathRandom random(Sampling::kIndependent, 3, 0, number, i);
      const EmitterSample s = set.sample(number, reference, random.get_2d(0, Event::kLightPosition),
                                         random.get_1d(0, Event::kLightPrimitive));
      ASSERT_GT(s.pdf_solid_angle, 0);
      SurfaceHit hit;
      ASSERT_TRUE(lights.scene->intersect({reference, s.wi}, hit));
      EXPECT_EQ(set.number_of(hit), number);
      EXPECT_NEAR(LightSet::pdf_solid_angle(reference, hit), s.pdf_solid_angle, 2e-3 * s.pdf_solid_angle);
      EXPECT_EQ(s.radiance, set[number].emitter->surface_radiance(hit, -s.wi));
    }
}

// The parts' densities, weighted as `path` chooses among triangles, sum to that of the whole light.
TEST(LightSet, PartsByAreaMakeUpTheWhole) {
  const ManyLights lights;
  const LightSet set(*lights.scene, LightSelection::kShape);
  for (const float x : {0.3f, 2.1f}) {
    SurfaceHit hit;
    ASSERT_TRUE(lights.scene->intersect({{x, 0.2f, 0}, {0, 0, 1}}, hit));
    const float whole = hit.emitter->pdf_solid_angle({1, 1, 0}, hit);
    EXPECT_NEAR(set[set.number_of(hit)].pmf * 4 * LightSet::pdf_solid_angle({1, 1, 0}, hit), whole, 1e-5 * whole);
  }
}

TEST(LightSet, PartsCarryThePowerOfTheWhole) {
  const ManyLights lights;
  const Emitter& mesh = *lights.scene->emitters()[0];
  EXPECT_NEAR(luminance(mesh.part_power(0) + mesh.part_power(1)), luminance(mesh.power()), 1e-5);
}

/// What emits on both sides is grouped by place; what does not, by direction, too.
TEST(LightSet, TwoSidedLightsHaveNoDirection) {
  for (const bool two_sided : {false, true}) {
    SceneParts parts;
    for (const float x : {0.0f, 0.4f, 1.5f}) {
      MeshData data;
      data.positions = {{x, 0, 0}, {x, 0.1f, 0}, {x + 0.1f, 0, 0}};
      data.triangles = {{0, 1, 2}};
      data.flip_normals = x == 0.4f;
      auto shape = std::make_shared<TriangleMesh>(std::move(data));
      AreaLightSettings settings{std::make_shared<ConstantTexture>(Spectrum(1))};
      settings.two_sided = two_sided;
      auto light = std::make_shared<AreaLight>(std::move(settings));
      light->attach(shape.get());
      shape->set_emitter(light);
      shape->set_bsdf(std::make_shared<BlackBsdf>());
      parts.shapes.push_back(std::move(shape));
      parts.emitters.push_back(light);
    }
    parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
    const Scene scene(std::move(parts));
    const LightClusters clusters = cluster_light_set(LightSet(scene, LightSelection::kPower), scene.bounds(), 2);
    ASSERT_EQ(clusters.n_clusters, 2u);
    EXPECT_EQ(clusters.cluster_of[0] == clusters.cluster_of[1], two_sided);
    EXPECT_EQ(clusters.cluster_of[0] == clusters.cluster_of[2], !two_sided);
  }
}

/// A spotlight projecting a texture of 300 x 300 texels, of which only 2 x 2 at the given place are bright.
std::shared_ptr<Emitter> spot_with_bright_texels(int x, int y) {
  TexelImage image;
  image.width = image.height = 300, image.channels = 3;
  image.floats.resize(image.n_pixels() * 3);
  for (int i = 0; i < 4; ++i) std::fill_n(image.floats.begin() + ((y + i / 2) * image.width + x + i % 2) * 3, 3, 1e5f);
  Diagnostics diagnostics;
  GivenObjects objects(diagnostics);
  const NamedValues values = {{"texture", objects.nest("texture", make_bitmap_texture(image, {}))}};
  return make_plugin<Emitter>(emitter_plugins(), "emitter", "spot", values, objects, diagnostics).object;
}

TEST(LightSet, FindsThePowerOfASpotWithFewBrightTexels) {
  SceneParts parts;
  parts.emitters.push_back(spot_with_bright_texels(141, 157));
  parts.emitters.push_back(make_plugin<Emitter>(emitter_plugins(), "emitter", "point", {}).object);
  parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
  // Its intensity is 1e5 in 4 of the 300^2 texels of a square with side 2 tan 20 degrees at distance 1.
  const double spot = 4e5 * std::pow(2 * std::tan(20 * M_PI / 180) / 300, 2);
  EXPECT_NEAR(mean(parts.emitters[0]->power()), spot, 0.02 * spot);
  const LightSet set(Scene(std::move(parts)), LightSelection::kPower);
  EXPECT_NEAR(set[0].pmf, spot / (spot + 4 * M_PI), 0.02 * set[0].pmf);
}

/// Black wherever its power is probed, as a texture can be between the points of an estimate.
class SeemsBlack final : public Emitter {
 public:
  EmitterSample sample_towards(const Vec3&, Vec2, float) const override { return {}; }
  EmissionSample sample_emission(Vec2, Vec2, float) const override { return {}; }
  EmissionPdf pdf_emission(const SurfaceHit&, const Vec3&) const override { return {}; }
  Spectrum power() const override { return {}; }
  bool knows_power() const override { return false; }
};

TEST(LightSet, ALightWhoseEstimatedPowerIsZeroStaysPossible) {
  SceneParts parts;
  parts.emitters.push_back(std::make_shared<SeemsBlack>());
  parts.emitters.push_back(make_plugin<Emitter>(emitter_plugins(), "emitter", "point", {}).object);
  parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
  const Scene scene(std::move(parts));
  for (const LightSelection selection : {LightSelection::kPower, LightSelection::kLearned})
    EXPECT_NEAR(LightSet(scene, selection)[0].pmf, 0.005 / 1.005, 1e-6) << name_of(selection);
}

TEST(LightSet, IsEmptyWithAnEnvironmentAlone) {
  SceneParts parts;
  parts.emitters.push_back(make_plugin<Emitter>(emitter_plugins(), "emitter", "constant", {}).object);
  parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
  EXPECT_TRUE(LightSet(Scene(std::move(parts)), LightSelection::kPower).empty());
}

TEST(LightSet, TakesProbabilitiesFromElsewhere) {
  const ManyLights many;
  LightSet lights(*many.scene, LightSelection::kLearned);
  std::vector<double> weights(lights.size(), 0);
  weights[0] = 3, weights[lights.size() - 1] = 1;
  lights.change(weights);
  EXPECT_NEAR(lights[0].pmf, 0.75, 1e-6);
  EXPECT_EQ(lights.select(0.5f), 0u);
  EXPECT_EQ(lights.select(0.9f), lights.size() - 1);
  EXPECT_EQ(lights[1].pmf, 0);
}

}  // namespace
}  // namespace covary
