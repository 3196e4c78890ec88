// SPDX-License-Identifier: Apache-2.0
// Densities of emitted light: pdf_emission() against sample_emission(), by chi-square tests and quadrature.
//
// Chi-square tests: N = 100 000 in 64 cells, alpha = 5e-7; they detect an rms error of 3.5 % of a density with power
// 0.99.
#include <OpenImageIO/imageio.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>
#include <ostream>

#include "core/warp.h"
#include "emitters/registry.h"
#include "scene/analytic_shape.h"
#include "scene/mesh.h"
#include "support/describe.h"
#include "support/files.h"
#include "support/light_scene.h"
#include "textures/bitmap.h"

namespace covary {
namespace {

using namespace test_support;

statistics::Chi2Options options(const std::string& name) { return {.name = name, .n_samples = 100000, .n_cells = 64}; }

TexturePtr constant() { return std::make_shared<ConstantTexture>(Spectrum(1, 2, 3)); }
TexturePtr picture() {
  TexelImage image;
  image.width = 5, image.height = 4, image.channels = 3;
  for (int i = 0; i < 60; ++i) image.floats.push_back(static_cast<float>(mix64(i) >> 40) * 0x1p-24f);
  image.floats[3 * 7] = 30;
  return make_bitmap_texture(image, {});
}

const Transform kPlaced = Transform::translate({0.3f, -0.2f, 2}) * Transform::rotate({1, 0.4f, 0}, 160);

/// The square [-1, 1]^2 in z = 0 under `t`; `u_end` < 1 stretches the texture, which then cannot be sampled by
/// luminance.
std::shared_ptr<Shape> rectangle(const Transform& t, float u_end = 1, bool flip = false) {
  MeshData data;
  for (const Vec3& p : {Vec3{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}}) data.positions.push_back(t.point(p));
  data.uvs = {{0, 0}, {u_end, 0}, {u_end, 1}, {0, 1}};
  data.triangles = {{0, 1, 2}, {2, 3, 0}};
  data.flip_normals = flip;
  return std::make_shared<TriangleMesh>(std::move(data));
}

/// Surface parameters of an area light as coordinates on the unit square. `spread`: surface area per unit area of it.
struct Case {
  const char* name;
  std::shared_ptr<Shape> (*shape)();
  TexturePtr (*radiance)();
  float u_end;
  double (*spread)(Vec2 uv);
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

double spread_of_sphere(Vec2 uv) { return 2 * M_PI * M_PI * 0.7 * 0.7 * std::sin(M_PI * uv.y); }
std::shared_ptr<Shape> sphere() { return std::make_shared<Sphere>(kPlaced, Vec3{1, 0, 0}, 0.7f, false); }

const Case kCases[] = {
    {"rectangle",
     [] {
       return rectangle(kPlaced * Transform::scale({0.8f, 1.3f, 1}));
     },
     constant, 1, [](Vec2) { return 4 * 0.8 * 1.3; }},
    {"textured_rectangle",
     [] {
       return rectangle(kPlaced * Transform::scale({0.8f, 1.3f, 1}));
     },
     picture, 1, [](Vec2) { return 4 * 0.8 * 1.3; }},
    {"mirrored_and_flipped",
     [] {
       return rectangle(kPlaced * Transform::scale({-2, 0.5f, 1}), 1, true);
     },
     picture, 1, [](Vec2) { return 4.0; }},
    {"textured_mesh", [] { return rectangle(kPlaced, 0.5f); }, picture, 0.5f, [](Vec2) { return 4.0; }},
    {"disk",
     [] {
       return std::shared_ptr<Shape>(std::make_shared<Disk>(kPlaced * Transform::scale({2, 1, 1}), false));
     },
     picture, 1, [](Vec2 uv) { return 4 * M_PI * uv.x; }},
    {"sphere", sphere, constant, 1, spread_of_sphere},
    {"textured_sphere", sphere, picture, 1, spread_of_sphere},
    {"inside_of_a_sphere",
     [] {
       return std::shared_ptr<Shape>(std::make_shared<Sphere>(kPlaced, Vec3{1, 0, 0}, 0.7f, true));
     },
     picture, 1, spread_of_sphere},
    {"cylinder",
     [] {
       return std::shared_ptr<Shape>(std::make_shared<Cylinder>(kPlaced, Vec3{0, 0, 0}, Vec3{0, 1, 2}, 0.4f, false));
     },
     picture, 1, [](Vec2) { return 2 * M_PI * 0.4 * std::sqrt(5.0); }},
};

class AreaEmission : public testing::TestWithParam<Case> {
 protected:
  const AreaLight& light() const { return scene_.light(); }
  /// Density of emission, per unit area of the unit square, at the surface point of these coordinates.
  double density(Vec2 x) const {
    const Vec2 uv{x.x * GetParam().u_end, x.y};
    return light().pdf_emission(point_on_light({}, {0, 0, 1}, uv), {0, 0, 1}).position * GetParam().spread(uv);
  }
  LightScene scene_{GetParam().shape(), GetParam().radiance()};
};

TEST_P(AreaEmission, PositionsFollowTheirDensity) {
  EXPECT_NEAR(statistics::integrate_square([&](const Vec2& x) { return density(x); }, 1e-4), 1, 5e-4);
  const auto sampler = [&](const PathRandom& random) -> std::optional<Vec2> {
    const EmissionSample s = draw_emission(light(), random);
    return Vec2{std::min(s.uv.x / GetParam().u_end, kOneMinusEpsilon), std::min(s.uv.y, kOneMinusEpsilon)};
  };
  const auto result = statistics::chi2_square(
      sampler, [&](const Vec2& x) { return density(x); }, options(GetParam().name));
  EXPECT_TRUE(result.accepted) << result.message;
  const auto wrong = statistics::chi2_square(  // planted: a density that tapers by 20 % across the light
      sampler, [&](const Vec2& x) { return density(x) * (1.1 - 0.2 * x.x); }, options(GetParam().name));
  EXPECT_FALSE(wrong.accepted);
}

TEST_P(AreaEmission, DirectionsFollowTheirDensity) {
  const auto sampler = [&](const PathRandom& random) -> std::optional<Vec3> {
    const EmissionSample s = draw_emission(light(), random);
    return Frame(s.n).to_local(s.ray.d);
  };
  const auto pdf = [&](const Vec3& w) -> double {
    return light().pdf_emission(point_on_light({}, {0, 0, 1}, {0.3f, 0.4f}), w).direction;
  };
  const auto result = statistics::chi2_sphere(sampler, pdf, options(GetParam().name));
  EXPECT_TRUE(result.accepted) << result.message;
  const auto wrong = statistics::chi2_sphere(  // planted: uniform on the hemisphere
      sampler, [](const Vec3& w) { return w.z > 0 ? 0.5 / M_PI : 0; }, options(GetParam().name));
  EXPECT_FALSE(wrong.accepted);
}

TEST_P(AreaEmission, SamplesCarryTheirDensities) {
  for (int i = 0; i < 300; ++i) {
    const EmissionSample s = draw_emission(light(), PathRandom(Sampling::kIndependent, 8, 0, 0, i));
    const EmissionPdf pdf = light().pdf_emission(point_on_light(s.ray.o, s.n, s.uv), s.ray.d);
    EXPECT_NEAR(pdf.position, s.pdf_position, 1e-4f * s.pdf_position);
    EXPECT_NEAR(pdf.direction, s.pdf_direction, 1e-4f * s.pdf_direction);
    EXPECT_FALSE(s.delta_position || s.delta_direction);
    // Paths that hit this point ask for the same density.
    SurfaceHit hit;
    ASSERT_TRUE(scene_.scene().intersect({s.ray.o + s.ray.d * 1e-2f, -s.ray.d, 2e-2f}, hit));
    const EmissionPdf found = light().pdf_emission(hit, s.ray.d);
    EXPECT_NEAR(found.position, s.pdf_position, 2e-2f * s.pdf_position);
    EXPECT_NEAR(found.direction, s.pdf_direction, 1e-3f);
    // The density of sample_towards() for this point also depends on the point alone.
    const Vec3 from = s.ray.at(0.5f);
    EXPECT_NEAR(light().pdf_solid_angle(from, point_on_light(s.ray.o, s.n, s.uv)), light().pdf_solid_angle(from, hit),
                3e-2f * light().pdf_solid_angle(from, hit));
  }
  const SurfaceHit at = point_on_light({}, {0, 0, 1}, {0.5f, 0.5f});
  EXPECT_EQ(light().pdf_emission(at, {0, 0.6f, -0.8f}).direction, 0);
}

// Mean power carried by emitted rays, N = 200 000, against the integral of radiance and cosine over the surface.
TEST_P(AreaEmission, PowerIsTheIntegralOfRadiance) {
  double expected = 0;
  constexpr int kGrid = 500;
  for (int y = 0; y < kGrid; ++y)
    for (int x = 0; x < kGrid; ++x) {
      const Vec2 uv{(x + 0.5f) / kGrid * GetParam().u_end, (y + 0.5f) / kGrid};
      const Spectrum radiance = light().surface_radiance(point_on_light({}, {0, 0, 1}, uv), {0, 0, 1});
      expected += luminance(radiance) * M_PI * GetParam().spread(uv) / (kGrid * kGrid);
    }
  const auto estimate = [&](const PathRandom& random) { return power_estimate(light(), true, random); };
  const auto result = mean_test(estimate, expected, 200000, 1e-3 * expected);
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_FALSE(mean_test([&](const PathRandom& r) { return 1.05 * estimate(r); }, expected).accepted);
}

INSTANTIATE_TEST_SUITE_P(Shapes, AreaEmission, testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

// ---- lights that are points or infinitely far ----

Made<Emitter> make(const std::string& type, const NamedValues& values) {
  return make_plugin<Emitter>(emitter_plugins(), "emitter", type, values);
}

void expect_samples_carry_densities(const Emitter& light) {
  for (int i = 0; i < 300; ++i) {
    const EmissionSample s = draw_emission(light, PathRandom(Sampling::kIndependent, 2, 0, 0, i));
    if (!(s.pdf_direction > 0)) continue;
    const EmissionPdf pdf = light.pdf_emission({}, s.ray.d);
    EXPECT_NEAR(pdf.position, s.pdf_position, 1e-5f * s.pdf_position);
    EXPECT_NEAR(pdf.direction, s.pdf_direction, 2e-3f * s.pdf_direction);
    EXPECT_EQ(s.delta_position, light.is_delta_position());
    EXPECT_EQ(s.delta_direction, light.is_delta_direction());
  }
}

void expect_directions_follow_density(const Emitter& light, const std::string& name, double mass_tolerance = 5e-4) {
  const auto pdf = [&](const Vec3& w) -> double { return light.pdf_emission({}, w).direction; };
  const auto sampler = [&](const PathRandom& random) -> std::optional<Vec3> {
    return draw_emission(light, random).ray.d;
  };
  statistics::Chi2Options o = options(name);
  o.mass_tolerance = mass_tolerance;
  const auto result = statistics::chi2_sphere(sampler, pdf, o);
  EXPECT_TRUE(result.accepted) << result.message;
  const auto wrong =  // planted: the direction towards the light instead of away from it
      statistics::chi2_sphere(
          sampler, [&](const Vec3& w) { return pdf(-w) * (1.1 - 0.2 * (w.x > 0)); }, o);
  EXPECT_FALSE(wrong.accepted);
}

const Bounds3 kBounds = {{-1, -2, -3}, {3, 2, 1}};

TEST(Emission, PointLight) {
  const auto light = make("point", {{"position", Vec3{1, 2, 3}}}).object;
  EXPECT_TRUE(light->is_delta_position() && light->is_delta() && !light->is_delta_direction() && !light->is_infinite());
  expect_samples_carry_densities(*light);
  expect_directions_follow_density(*light, "point");
}

TEST(Emission, SpotLight) {
  const Transform to_world = Transform::look_at({0.1f, 0.2f, 3}, {0, 1, 0}, {0, 1, 0});
  const auto light = make("spot", {{"cutoff_angle", 40.0}, {"to_world", to_world}}).object;
  EXPECT_TRUE(light->is_delta_position() && light->is_delta() && !light->is_delta_direction() && !light->is_infinite());
  expect_samples_carry_densities(*light);
  // The density jumps at the edge of the cone, which the quadrature resolves to 1 %.
  expect_directions_follow_density(*light, "spot", 1e-2);
}

TEST(Emission, DirectionalLight) {
  const auto light = make("directional", {{"direction", Vec3{0.3f, -0.4f, 0.5f}}}).object->in_scene(kBounds);
  EXPECT_TRUE(light->is_delta_direction() && light->is_delta() && !light->is_delta_position() && light->is_infinite());
  expect_samples_carry_densities(*light);
}

TEST(Emission, ConstantLight) {
  const auto light = make("constant", {}).object->in_scene(kBounds);
  EXPECT_TRUE(!light->is_delta() && light->is_infinite());
  expect_samples_carry_densities(*light);
  expect_directions_follow_density(*light, "constant");
}

TEST(Emission, EnvironmentMap) {
  const TemporaryFolder folder;
  std::vector<float> pixels(12 * 7 * 3, 0.3f);
  for (int c = 0; c < 3; ++c) pixels[3 * (12 * 2 + 5) + c] = 20.0f + 10.0f * static_cast<float>(c);
  const auto output = OIIO::ImageOutput::create(folder.file("sun.exr"));
  ASSERT_TRUE(output && output->open(folder.file("sun.exr"), OIIO::ImageSpec(12, 7, 3, OIIO::TypeDesc::FLOAT)));
  ASSERT_TRUE(output->write_image(OIIO::TypeDesc::FLOAT, pixels.data()) && output->close());
  for (const bool compensated : {false, true}) {
    const auto light = make("envmap", {{"filename", folder.file("sun.exr")},
                                       {"mis_compensation", compensated},
                                       {"to_world", Transform::rotate({1, 2, 3}, 40) * Transform::scale({1, -1, 1})}})
                           .object->in_scene(kBounds);
    EXPECT_TRUE(!light->is_delta() && light->is_infinite());
    expect_samples_carry_densities(*light);
    expect_directions_follow_density(*light, "envmap");
  }
}

// sample_emission() through a square in the scene, N = 400 000 rays, against the irradiance by sample_towards(): tests
// positions on the disk and directions together.
TEST(Emission, InfiniteLightsLightASurfaceEvenly) {
  const Vec3 corner{-0.5f, -1.2f, -2}, e1{2.6f, 0.4f, 0}, e2{-0.2f, 2.4f, 0.6f}, area = cross(e1, e2);
  const Vec3 n = normalize(area);
  for (const auto& made :
       {make("constant", {}).object, make("directional", {{"direction", Vec3{0.3f, -0.4f, -0.5f}}}).object}) {
    const auto light = made->in_scene(kBounds);
    const double expected = light->is_delta() ? dot(n, normalize(Vec3{-0.3f, 0.4f, 0.5f})) : M_PI;
    const auto estimate = [&](const PathRandom& random) -> double {
      const EmissionSample s = draw_emission(*light, random);
      const float t = dot(corner - s.ray.o, n) / dot(s.ray.d, n);
      const Vec3 q = s.ray.at(t) - corner;
      const double a = dot(cross(q, e2), n) / length(area), b = dot(cross(e1, q), n) / length(area);
      if (!(t > 0 && dot(s.ray.d, n) < 0 && a >= 0 && a < 1 && b >= 0 && b < 1)) return 0;
      return luminance(s.radiance) / (static_cast<double>(s.pdf_position) * s.pdf_direction) / length(area);
    };
    const auto result = mean_test(estimate, expected, 400000);
    EXPECT_TRUE(result.accepted) << result.message;
    EXPECT_FALSE(mean_test([&](const PathRandom& r) { return 1.1 * estimate(r); }, expected, 400000).accepted);
  }
}

}  // namespace
}  // namespace covary
