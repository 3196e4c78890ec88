// SPDX-License-Identifier: Apache-2.0
#include "emitters/area.h"

#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "emitters/registry.h"
#include "scene/analytic_shape.h"
#include "scene/mesh.h"
#include "support/describe.h"
#include "support/light_scene.h"
#include "textures/bitmap.h"
#include "textures/registry.h"

namespace covary {
namespace {

using namespace test_support;

/// The square [-1, 1]^2 in z = 0 under `t`, normal +z, (u, v) over the unit square: the scene files' `rectangle`.
std::shared_ptr<TriangleMesh> rectangle(const Transform& t) {
  MeshData data;
  for (const Vec3& p : {Vec3{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}) data.positions.push_back(t.point(p));
  data.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  data.triangles = {{0, 1, 2}, {2, 3, 0}};
  return std::make_shared<TriangleMesh>(std::move(data));
}

/// 4 x 3 texels, one of which holds most of the light.
TexturePtr picture() {
  TexelImage image;
  image.width = 4, image.height = 3, image.channels = 3;
  for (int i = 0; i < 36; ++i) image.floats.push_back(static_cast<float>(mix64(i) >> 40) * 0x1p-24f);
  image.floats[3 * 6] = 40;
  return make_bitmap_texture(image, {});
}

TexturePtr constant(const Spectrum& value = {1, 2, 3}) { return std::make_shared<ConstantTexture>(value); }

const Transform kPlaced =
    Transform::translate({0.3f, -0.2f, 2}) * Transform::rotate({1, 0.4f, 0}, 160) * Transform::scale({0.8f, 1.3f, 1});
const Vec3 kReference = {0.2f, 0.1f, -0.4f};

/// Coordinates on the unit square in which the density of a light's directions is smooth, so that quadrature is
/// accurate: surface parameters, or, for a sphere seen from outside, a parameterisation of its cone.
struct Chart {
  std::function<std::optional<Vec2>(const EmitterSample&)> coordinates;
  std::function<double(Vec2)> density;  ///< of the light's own pdf_solid_angle(), per unit area of the square
};

/// Chart by (u, v). `at`: surface point whose pdf_area is the inverse of its area per unit (u, v) area.
Chart surface_chart(const LightScene& scene, const std::function<AreaSample(Vec2)>& at) {
  return {[](const EmitterSample& s) { return s.uv; },
          [&scene, at](Vec2 uv) {
            const AreaSample point = at(uv);
            SurfaceHit hit;
            hit.p = point.p, hit.ng = point.n, hit.uv = uv, hit.shape = scene.light().shape();
            const Vec3 d = point.p - kReference;
            const double d2 = length_squared(d), cosine = std::abs(dot(d, point.n)) / std::sqrt(d2);
            // From per unit solid angle to per unit area to per unit (u, v).
            return scene.light().pdf_solid_angle(kReference, hit) * cosine / d2 / point.pdf_area;
          }};
}

const Vec3 kSphereCenter = {1, 0, 2};
constexpr float kSphereRadius = 0.7f;

Chart cone_chart(const LightScene& scene) {
  const Vec3 to_center = kSphereCenter - kReference;
  const double one_minus_cos_max = 1 - std::sqrt(1 - kSphereRadius * kSphereRadius / length_squared(to_center));
  const Frame frame(normalize(to_center));
  return {[=](const EmitterSample& s) -> std::optional<Vec2> {
            const Vec3 local = frame.to_local(s.wi);
            const float phi = std::atan2(local.y, local.x) / kTwoPi;
            const double x = (local.x * local.x + local.y * local.y) / (1 + local.z) / one_minus_cos_max;
            if (x > 1.0001) return std::nullopt;
            return Vec2{std::min(static_cast<float>(x), kOneMinusEpsilon),
                        std::min(phi < 0 ? phi + 1 : phi, kOneMinusEpsilon)};
          },
          [=, &scene](Vec2 x) {
            const double z = 1 - one_minus_cos_max * std::min(x.x, 0.9999f), rho = std::sqrt(1 - z * z);
            const Vec3 local = {static_cast<float>(rho * std::cos(2 * M_PI * x.y)),
                                static_cast<float>(rho * std::sin(2 * M_PI * x.y)), static_cast<float>(z)};
            SurfaceHit hit;
            if (!scene.scene().intersect({kReference, frame.to_world(local)}, hit)) return 0.0;
            return scene.light().pdf_solid_angle(kReference, hit) * 2 * M_PI * one_minus_cos_max;
          }};
}

AreaSample on_disk(Vec2 uv) {  // (u, v) = (r, phi / 2 pi) of the unit disk under kPlaced
  const float phi = kTwoPi * uv.y;
  const Vec3 x = kPlaced.vector({1, 0, 0}), y = kPlaced.vector({0, 1, 0});
  return {kPlaced.point({uv.x * std::cos(phi), uv.x * std::sin(phi), 0}), normalize(kPlaced.normal({0, 0, 1})), uv,
          1 / (kTwoPi * uv.x * length(cross(x, y)))};
}

AreaSample inside_sphere(
    Vec2 uv) {  // (u, v) = (phi, theta) of the sphere around (1, 0, 0) of radius 3, normals inwards
  const float phi = kTwoPi * uv.x, theta = kPi * uv.y, sine = std::max(std::sin(theta), 1e-6f);
  const Vec3 d = {sine * std::cos(phi), sine * std::sin(phi), std::cos(theta)};
  return {Vec3{1, 0, 0} + d * 3, -d, uv, 1 / (2 * kPi * kPi * 9 * sine)};
}

/// A square seen counter-clockwise from +z, with vertex normals towards -z: its front is at z < 0, where Mitsuba and
/// pbrt have it, however light is sampled. As one parallelogram, and as two triangles.
TEST(AreaLight, ShinesOnTheSideOfTheVertexNormals) {
  for (const bool with_uvs : {true, false}) {
    MeshData data;
    data.positions = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}};
    data.normals.assign(4, {0, 0, -1});
    if (with_uvs) data.uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    data.triangles = {{0, 1, 2}, {2, 3, 0}};
    TriangleMesh mesh(data);
    mesh.prepare_sampling();
    AreaLight light(constant());
    light.attach(&mesh);
    ASSERT_EQ(light.parallelogram() != nullptr, with_uvs);
    if (with_uvs) {
      EXPECT_EQ(light.parallelogram()->surface.n.z, -1);
    }

    SurfaceHit hit;
    hit.shape = &mesh, hit.barycentric = {0.25f, 0.5f};
    mesh.fill({}, hit, false);
    EXPECT_EQ(hit.ng.z, 1);
    EXPECT_EQ(light.surface_radiance(hit, {0, 0, 1}).r, 0);
    EXPECT_EQ(light.surface_radiance(hit, {0, 0, -1}).r, 1);
    EXPECT_EQ(light.pdf_emission(hit, {0, 0, 1}).direction, 0);
    EXPECT_FLOAT_EQ(light.pdf_emission(hit, {0, 0, -1}).direction, 1 / kPi);

    EXPECT_EQ(light.sample_towards({0, 0, 3}, {0.3f, 0.4f}, 0.2f).radiance.r, 0);
    const EmitterSample below = light.sample_towards({0, 0, -3}, {0.3f, 0.4f}, 0.2f);
    EXPECT_EQ(below.radiance.r, 1);
    EXPECT_EQ(below.n.z, -1);
    EXPECT_EQ(light.sample_part_towards(0, {0, 0, -3}, {0.3f, 0.4f}, 0.2f).radiance.r, 1);
    const EmissionSample leaving = light.sample_emission({0.3f, 0.4f}, {0.6f, 0.7f}, 0.2f);
    EXPECT_LT(leaving.ray.d.z, 0);
    EXPECT_FLOAT_EQ(light.pdf_emission(point_on_light(leaving.ray.o, leaving.n, leaving.uv), leaving.ray.d).direction,
                    leaving.pdf_direction);
  }
}

struct Case {
  const char* name;
  LightScene (*make)();
  Chart (*chart)(const LightScene&);
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

Chart rectangle_chart(const LightScene& scene) {
  return surface_chart(scene, [](Vec2 uv) { return rectangle(kPlaced)->sample_uv(uv); });
}

/// A rectangle with a stretched texture, whose (u, v) do not cover the unit square: no sampling by luminance.
std::shared_ptr<TriangleMesh> stretched() {
  MeshData data;
  for (const Vec3& p : {Vec3{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}) data.positions.push_back(kPlaced.point(p));
  data.uvs = {{0, 0}, {0.5f, 0}, {0.5f, 1}, {0, 1}};
  data.triangles = {{0, 1, 2}, {2, 3, 0}};
  return std::make_shared<TriangleMesh>(std::move(data));
}

Chart stretched_chart(const LightScene& scene) {
  Chart chart = surface_chart(scene, [](Vec2 uv) { return rectangle(kPlaced)->sample_uv(uv); });
  chart.coordinates = [](const EmitterSample& s) { return Vec2{std::min(2 * s.uv.x, kOneMinusEpsilon), s.uv.y}; };
  return chart;
}

/// The mesh with a colour per vertex, over a wide range of brightness.
std::shared_ptr<TriangleMesh> coloured(const TriangleMesh& mesh) {
  MeshData data;
  for (const auto& vertex : mesh.vertices()) {
    const auto i = static_cast<float>(data.positions.size());
    data.positions.push_back(vertex.p), data.uvs.push_back(vertex.uv);
    data.colours.push_back({1 + 3 * i, 7 - i, i == 2 ? 9.0f : 0.5f});
  }
  data.triangles = mesh.triangles();
  return std::make_shared<TriangleMesh>(std::move(data));
}

TexturePtr vertex_colours() { return make_plugin<Texture>(texture_plugins(), "texture", "vertexcolor", {}).object; }

const Case kCases[] = {
    {"rectangle", [] { return LightScene(rectangle(kPlaced), constant()); }, rectangle_chart},
    {"textured_rectangle", [] { return LightScene(rectangle(kPlaced), picture()); }, rectangle_chart},
    {"textured_mesh", [] { return LightScene(stretched(), picture()); }, stretched_chart},
    {"coloured_rectangle", [] { return LightScene(coloured(*rectangle(kPlaced)), vertex_colours()); }, rectangle_chart},
    {"coloured_mesh", [] { return LightScene(coloured(*stretched()), vertex_colours()); }, stretched_chart},
    {"disk", [] { return LightScene(std::make_shared<Disk>(kPlaced, false), constant()); },
     [](const LightScene& scene) { return surface_chart(scene, on_disk); }},
    {"sphere",
     [] { return LightScene(std::make_shared<Sphere>(Transform(), kSphereCenter, kSphereRadius, false), constant()); },
     cone_chart},
    {"textured_sphere",
     [] { return LightScene(std::make_shared<Sphere>(Transform(), kSphereCenter, kSphereRadius, false), picture()); },
     cone_chart},
    {"around",
     [] {
       return LightScene(std::make_shared<Sphere>(Transform(), Vec3{1, 0, 0}, 3.0f, true), constant());
     },
     [](const LightScene& scene) { return surface_chart(scene, inside_sphere); }},
};

class AreaLights : public testing::TestWithParam<Case> {};

// N = 400 000, alpha = 5e-7: detects an rms error of 2.3 % of the density with power 0.99 (statistics/chi2.h).
TEST_P(AreaLights, DirectionsFollowTheirDensity) {
  const LightScene scene = GetParam().make();
  const Chart chart = GetParam().chart(scene);
  const auto sampler = [&](const PathRandom& r) -> std::optional<Vec2> {
    const EmitterSample s = draw_towards(scene.light(), kReference, r);
    return s.pdf_solid_angle > 0 ? chart.coordinates(s) : std::nullopt;
  };
  const auto result = statistics::chi2_square(sampler, chart.density, {.name = GetParam().name});
  EXPECT_TRUE(result.accepted) << result.message;
  // Planted bug: a density that tapers by 20 % across the light.
  const auto wrong =
      statistics::chi2_square(sampler, [&](const Vec2& x) { return chart.density(x) * (1.1 - 0.2 * x.y); },
                              {.name = GetParam().name, .n_samples = 100000});
  EXPECT_FALSE(wrong.accepted);
}

TEST_P(AreaLights, SamplesAgreeWithHits) {
  const LightScene scene = GetParam().make();
  int n_lit = 0;
  for (int i = 0; i < 500; ++i) {
    const EmitterSample s = draw_towards(scene.light(), kReference, PathRandom(Sampling::kIndependent, 9, 0, 0, i));
    if (!(s.pdf_solid_angle > 0)) continue;
    EXPECT_NEAR(length(s.p - kReference), s.distance, 1e-5f * s.distance);
    SurfaceHit hit;
    if (is_black(s.radiance)) continue;  // back-facing: perhaps hidden
    ++n_lit;
    ASSERT_TRUE(scene.scene().intersect({kReference, s.wi}, hit));
    if (hit.t < s.distance * 0.999f) continue;  // hidden by another part of the light
    EXPECT_NEAR(hit.t, s.distance, 1e-4f);
    EXPECT_LT(length(hit.ng - s.n), 1e-3f);
    const Spectrum seen = scene.light().surface_radiance(hit, -s.wi);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen[c], s.radiance[c], 1e-3f * (1 + s.radiance[c]));
    if (std::abs(dot(hit.ng, s.wi)) < 0.05f) continue;  // grazing: the cosine is imprecise
    EXPECT_NEAR(scene.light().pdf_solid_angle(kReference, hit), s.pdf_solid_angle, 2e-3f * s.pdf_solid_angle);
  }
  EXPECT_GT(n_lit, 100);
}

TEST_P(AreaLights, EmittedRaysCarryThePower) {
  const LightScene scene = GetParam().make();
  const double power = luminance(scene.light().power());
  const auto estimate = [&](const PathRandom& r) { return power_estimate(scene.light(), true, r); };
  // Power of textured lights is a sum over 4096 points, with an error below 1 %.
  EXPECT_TRUE(mean_test(estimate, power, 200000, 1e-2 * power).accepted);
  EXPECT_FALSE(
      mean_test([&](const PathRandom& r) { return 1.05 * estimate(r); }, power, 200000, 1e-2 * power).accepted);
  for (int i = 0; i < 200; ++i) {
    const EmissionSample s = draw_emission(scene.light(), PathRandom(Sampling::kIndependent, 8, 0, 0, i));
    EXPECT_GT(dot(s.n, s.ray.d), 0);
    SurfaceHit hit;  // seen from outside, the origin emits this radiance in this direction
    ASSERT_TRUE(scene.scene().intersect({s.ray.o + s.ray.d * 1e-2f, -s.ray.d, 2e-2f}, hit));
    const Spectrum seen = scene.light().surface_radiance(hit, s.ray.d);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(seen[c], s.radiance[c], 2e-2f * (1 + s.radiance[c]));
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, AreaLights, testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

/// Irradiance at the origin on a surface facing `n`, against its closed form; and a planted error of 2 %.
void expect_irradiance(const LightScene& scene, const Vec3& n, double expected) {
  const auto estimate = [&](const PathRandom& r) { return irradiance_estimate(scene.light(), {}, n, r); };
  const auto result = mean_test(estimate, expected);
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_FALSE(mean_test([&](const PathRandom& r) { return 1.02 * estimate(r); }, expected).accepted);
}

TEST(AreaLight, IrradianceOfADisk) {
  // Disk of radius R at height h over the point, parallel to the surface: pi L R^2 / (R^2 + h^2).
  const Transform t =
      Transform::translate({0, 0, 2}) * Transform::rotate({1, 0, 0}, 180) * Transform::scale({1.5f, 1.5f, 1});
  expect_irradiance(LightScene(std::make_shared<Disk>(t, false), constant(Spectrum(2))), {0, 0, 1},
                    M_PI * 2 * 2.25 / (2.25 + 4));
}

TEST(AreaLight, IrradianceOfASphere) {
  // pi L (r / d)^2 for a surface that faces the centre and sees the whole visible side of the sphere.
  expect_irradiance(
      LightScene(std::make_shared<Sphere>(Transform(), Vec3{0, 3, 0}, 1.0f, false), constant(Spectrum(2))), {0, 1, 0},
      M_PI * 2 / 9);
}

TEST(AreaLight, IrradianceOfARectangle) {
  // Corner above the point, sides a h and b h at height h, parallel to the surface:
  // E = L / 2 [a / sqrt(1 + a^2) atan(b / sqrt(1 + a^2)) + b / sqrt(1 + b^2) atan(a / sqrt(1 + b^2))].
  const double a = 1.5, b = 0.8, sa = std::sqrt(1 + a * a), sb = std::sqrt(1 + b * b);
  const double expected = 2 * 0.5 * (a / sa * std::atan(b / sa) + b / sb * std::atan(a / sb));
  const Transform t = Transform::translate({1.5f, 0.8f, 2}) * Transform::scale({1.5f, -0.8f, -1});
  MeshData data;
  for (const Vec3& p : {Vec3{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}) data.positions.push_back(t.point(p));
  data.triangles = {{0, 1, 2}, {2, 3, 0}};
  expect_irradiance(LightScene(std::make_shared<TriangleMesh>(data), constant(Spectrum(2))), {0, 0, 1}, expected);
}

TEST(AreaLight, IrradianceOfAPictureFromAllStrategies) {
  // By the midpoint rule over the surface; both sampling strategies must agree with it.
  const LightScene by_luminance(rectangle(kPlaced), picture());
  const auto mesh = rectangle(kPlaced);
  const Vec3 n = {0, 0, 1};
  double expected = 0;
  constexpr int kGrid = 400;
  for (int y = 0; y < kGrid; ++y)
    for (int x = 0; x < kGrid; ++x) {
      const AreaSample at = mesh->sample_uv({(x + 0.5f) / kGrid, (y + 0.5f) / kGrid});
      SurfaceHit hit;
      hit.uv = at.uv;
      const double d2 = length_squared(at.p);
      const Vec3 w = at.p * static_cast<float>(1 / std::sqrt(d2));
      expected += luminance(picture()->eval(hit)) * std::max(0.0f, w.z) * std::max(0.0f, -dot(w, at.n)) / d2 /
                  at.pdf_area / (kGrid * kGrid);
    }
  expect_irradiance(by_luminance, n, expected);
  // A third triangle far away, seen edge-on, so that the mesh is not a parallelogram: sampled uniformly by area.
  MeshData data;
  for (const auto& v : mesh->vertices()) data.positions.push_back(v.p), data.uvs.push_back(v.uv);
  data.triangles = mesh->triangles();
  for (const Vec3& p : {Vec3{1, 0, -2}, {2, 0, -2}, {1, 1, -2}})
    data.positions.push_back(p), data.uvs.push_back({0, 0});
  data.triangles.push_back({4, 5, 6});
  const auto other = std::make_shared<TriangleMesh>(data);
  EXPECT_EQ(other->sample_uv({0.5f, 0.5f}).pdf_area, 0);
  expect_irradiance(LightScene(other, picture()), n, expected);
}

TEST(AreaLight, PictureIsSampledInProportionToItsLuminance) {
  const LightScene scene(rectangle(kPlaced), picture());
  const double power = luminance(scene.light().power());
  for (int i = 0; i < 1000; ++i)
    EXPECT_NEAR(power_estimate(scene.light(), true, PathRandom(Sampling::kIndependent, 1, 0, 0, i)), power,
                1e-3 * power);
}

TEST(AreaLight, ClosedFormsOfPower) {
  EXPECT_NEAR(luminance(LightScene(std::make_shared<Disk>(Transform::scale({2, 2, 2}), false), constant(Spectrum(3)))
                            .light()
                            .power()),
              M_PI * 3 * M_PI * 4, 1e-3);
  EXPECT_NEAR(luminance(LightScene(rectangle(Transform()), constant(Spectrum(3))).light().power()), M_PI * 3 * 4, 1e-4);
}

TEST(AreaLight, EmitsOnOneSideOnly) {
  const LightScene scene(rectangle(Transform()), constant());
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene().intersect({{0.2f, 0.3f, 1}, {0, 0, -1}}, hit));
  EXPECT_EQ(hit.emitter, &scene.light());
  EXPECT_EQ(scene.light().surface_radiance(hit, {0, 0, 1}), Spectrum(1, 2, 3));
  EXPECT_EQ(scene.light().surface_radiance(hit, {0, 0, -1}), Spectrum(0));
  const EmitterSample behind = scene.light().sample_towards({0, 0, -1}, {0.2f, 0.3f}, 0.4f);
  EXPECT_EQ(behind.radiance, Spectrum(0));
  EXPECT_GT(scene.light().sample_towards({0, 0, 1}, {0.2f, 0.3f}, 0.4f).radiance.r, 0);
}

TEST(AreaLight, ClonesShareTheTextureButNotTheShape) {
  const auto shape = rectangle(Transform());
  AreaLight light(picture());
  light.attach(shape.get());
  const auto clone = light.clone();
  EXPECT_EQ(clone->shape(), nullptr);
  EXPECT_THROW(light.attach(shape.get()), Error);  // already attached to a shape
  const auto other = rectangle(kPlaced);
  clone->attach(other.get());
  EXPECT_EQ(clone->shape(), other.get());
  EXPECT_EQ(light.shape(), shape.get());
}

TEST(AreaLight, IsMadeFromParameters) {
  const auto made =
      make_plugin<Emitter>(emitter_plugins(), "emitter", "area", {{"radiance", ColourValue{{17, 12, 4}}}});
  ASSERT_EQ(made.errors, "");
  const auto light = std::dynamic_pointer_cast<AreaLight>(made.object);
  ASSERT_NE(light, nullptr);
  SurfaceHit hit;
  EXPECT_EQ(light->surface_radiance(hit, hit.ng + Vec3{0, 0, 1}), Spectrum(0));
  hit.ng = {0, 0, 1};
  EXPECT_EQ(light->surface_radiance(hit, {0, 0, 1}), Spectrum(17, 12, 4));
  const auto wrong = make_plugin<Emitter>(emitter_plugins(), "emitter", "area", {{"to_world", Transform()}});
  EXPECT_EQ(wrong.errors,
            "test.xml:2:1: unknown parameter 'to_world' of emitter 'area'; known: 'hidden', 'per_triangle', 'power', "
            "'radiance', 'two_sided'");
}

/// Both sides shine alike; light paths start on either, with the densities that pdf_emission() states.
TEST(AreaLight, MayShineOnBothSides) {
  const auto shape = rectangle(Transform());
  AreaLight light({constant(), true});
  light.attach(shape.get());
  shape->prepare_sampling();
  SurfaceHit hit;
  hit.ng = {0, 0, 1}, hit.frame = Frame({0, 0, 1});
  int n_behind = 0;
  for (int i = 0; i < 64; ++i) {
    const float x = (static_cast<float>(i) + 0.5f) / 64;
    for (const float side : {1.0f, -1.0f}) {
      const EmitterSample sample = light.sample_towards({0.1f, 0.2f, side}, {x, 0.3f}, x);
      EXPECT_EQ(sample.radiance, Spectrum(1, 2, 3));
      EXPECT_LT(dot(sample.n, sample.wi), 0);
      EXPECT_EQ(light.surface_radiance(hit, {0, 0, side}), Spectrum(1, 2, 3));
    }
    const EmissionSample emission = light.sample_emission({0.4f, 0.6f}, {x, 0.7f}, 0.3f);
    n_behind += emission.ray.d.z < 0;
    EXPECT_FLOAT_EQ(light.pdf_emission(hit, emission.ray.d).direction, emission.pdf_direction);
    EXPECT_FLOAT_EQ(emission.pdf_direction, std::abs(emission.ray.d.z) / kTwoPi);
  }
  EXPECT_EQ(n_behind, 32);
  EXPECT_FLOAT_EQ(light.power().g, 2 * (2 * kPi * 4));
}

TEST(AreaLight, MayHaveAPower) {
  const auto shape = rectangle(Transform());
  for (const bool per_triangle : {false, true}) {
    AreaLight light({constant(Spectrum(0.5f)), true, 10, per_triangle});
    light.attach(shape.get());
    shape->prepare_sampling();
    EXPECT_FLOAT_EQ(light.power().g, per_triangle ? 10 : 5);  // of two triangles
  }
}

}  // namespace
}  // namespace covary
