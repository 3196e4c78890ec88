// SPDX-License-Identifier: Apache-2.0
// The camera as a receiver of importance: densities, projection and sampling of the lens against Camera::ray().
#include <gtest/gtest.h>

#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "core/warp.h"
#include "scene/camera.h"
#include "statistics/chi2.h"

namespace covary {
namespace {

struct Case {
  const char* name;
  CameraSettings settings;
  int width, height;
};
void PrintTo(const Case& c, std::ostream* out) { *out << c.name; }

const Transform kPlaced = Transform::look_at({1, 2, 3}, {-0.5f, 0.3f, 0.2f}, {0.1f, 1, 0});

CameraSettings settings(const Transform& to_world, float fov, float aperture, float focus, Vec2 offset = {}) {
  CameraSettings s;
  s.to_world = to_world, s.fov_degrees = fov, s.aperture_radius = aperture, s.focus_distance = focus;
  s.principal_point_offset = offset;
  s.near_clip = 0.2f, s.far_clip = 50;
  return s;
}

/// A transformation with non-orthogonal axes that the camera still accepts.
Transform skewed() {
  Matrix4 m{};
  for (int i = 0; i < 4; ++i) m[i][i] = 1;
  m[0][0] = std::sqrt(0.99f), m[1][0] = 0.1f;
  return kPlaced * Transform(m);
}

const Case kCases[] = {
    {"pinhole", settings(kPlaced, 70, 0, 1), 40, 30},
    {"shifted", settings(kPlaced, 50, 0, 1, {0.2f, -0.1f}), 30, 40},
    {"mirrored", settings(kPlaced* Transform::scale({-1, 1, 1}), 60, 0, 1), 32, 32},
    {"thin_lens", settings(kPlaced, 50, 0.25f, 3), 40, 30},
    {"thin_lens_focused_far", settings(kPlaced* Transform::scale({1, -1, 1}), 80, 0.5f, 1e6f, {0, 0.1f}), 40, 40},
    {"skewed_thin_lens", settings(skewed(), 60, 0.3f, 2), 32, 24},
};

/// Over the sphere, by the midpoint rule; edges of the frame cost about 0.2 % accuracy.
template <typename Function>
double integral(const Function& f) {
  constexpr int kGrid = 700;
  double sum = 0;
  for (int y = 0; y < kGrid; ++y)
    for (int x = 0; x < kGrid; ++x) sum += f(statistics::direction_from_square((x + 0.5) / kGrid, (y + 0.5) / kGrid));
  return sum * 4 * M_PI / (kGrid * kGrid);
}

class CameraImportance : public testing::TestWithParam<Case> {
 protected:
  Camera camera_{GetParam().settings, GetParam().width, GetParam().height};
  float width() const { return static_cast<float>(GetParam().width); }
  float height() const { return static_cast<float>(GetParam().height); }
  bool in_frame(Vec2 film) const { return film.x >= 0 && film.x < width() && film.y >= 0 && film.y < height(); }
  Ray random_ray(int i, Vec2* film = nullptr) const {
    const PathRandom random(Sampling::kIndependent, 3, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kPixel);
    if (film) *film = {u.x * width(), u.y * height()};
    return camera_.ray({u.x * width(), u.y * height()}, random.get_2d(0, Event::kLens));
  }
};

TEST_P(CameraImportance, ProjectionInvertsRays) {
  for (int i = 0; i < 500; ++i) {
    Vec2 film;
    const Ray ray = random_ray(i, &film);
    for (const float t : {0.0f, 1.3f}) {
      const Vec2 found = camera_.project(ray.at(t), normalize(ray.d));
      EXPECT_NEAR(found.x, film.x, 2e-3f);
      EXPECT_NEAR(found.y, film.y, 2e-3f);
    }
  }
}

// Solid angle of a quarter pixel, by the vector area of the directions at its corners, times the density.
TEST_P(CameraImportance, DirectionDensityIsTheInverseOfSolidAnglePerPixel) {
  for (int i = 0; i < 200; ++i) {
    const PathRandom random(Sampling::kIndependent, 4, 0, 0, i);
    const Vec2 u = random.get_2d(0, Event::kPixel), lens = random.get_2d(0, Event::kLens);
    const Vec2 film{u.x * width(), u.y * height()};
    const auto d = [&](float x, float y) { return normalize(camera_.ray(film + Vec2{x, y}, lens).d); };
    const Vec3 area = cross(d(0.5f, 0.5f) - d(-0.5f, -0.5f), d(-0.5f, 0.5f) - d(0.5f, -0.5f)) * 0.5f;
    EXPECT_NEAR(camera_.pdf_direction(d(0, 0)) * length(area), 1, 4e-3f);
  }
}

// Directions from one point on the lens. N = 400 000: detects a 2.0 % rms error of the density with power 0.99. The
// edges of the frame, where the density jumps, are resolved by the quadrature to 1 %.
TEST_P(CameraImportance, DirectionsFollowTheirDensity) {
  const Vec2 lens{0.3f, 0.8f};
  const Vec3 on_lens = camera_.sample_towards(camera_.ray({1, 1}, lens).at(1), lens).p;
  const auto sampler = [&](const PathRandom& random) -> std::optional<Vec3> {
    const Vec2 u = random.get_2d(0, Event::kPixel);
    return normalize(camera_.ray({u.x * width(), u.y * height()}, lens).d);
  };
  const auto density = [&](const Vec3& d) -> double {
    const float pdf = camera_.pdf_direction(d);
    return pdf > 0 && in_frame(camera_.project(on_lens, d)) ? pdf / (width() * height()) : 0;
  };
  const auto result = statistics::chi2_sphere(sampler, density, {.name = GetParam().name, .mass_tolerance = 1e-2});
  EXPECT_TRUE(result.accepted) << result.message;
  // Planted bug: the cosine to the fourth power, i.e. importance instead of the density, with the right mass.
  const auto cubed = [&](const Vec3& d) -> double { return density(d) > 0 ? camera_.pdf_direction(d) : 0; };
  const auto fourth = [&](const Vec3& d) -> double { return density(d) > 0 ? camera_.importance(d) : 0; };
  const double scale = integral(cubed) / integral(fourth) / (width() * height());
  const auto wrong = statistics::chi2_sphere(sampler, [&](const Vec3& d) { return scale * fourth(d); },
                                             {.name = GetParam().name, .mass_tolerance = 0.5});
  EXPECT_FALSE(wrong.accepted);
}

// The integral of We cos over the directions of the frame and over the lens is the frame's number of pixels.
TEST_P(CameraImportance, IntegralOfImportanceIsTheFilmArea) {
  const Vec3 on_lens = camera_.sample_towards(camera_.ray({1, 1}, {0.5f, 0.5f}).at(1), {0.5f, 0.5f}).p;
  const Vec3 axis = normalize(GetParam().settings.to_world.normal({0, 0, 1}));
  const double found = integral([&](const Vec3& d) -> double {
    const float we = camera_.importance(d);
    return we > 0 && in_frame(camera_.project(on_lens, d)) ? we * dot(d, axis) : 0;
  });
  const double lens_area = 1 / camera_.pdf_position(), expected = width() * height();
  EXPECT_NEAR(found * lens_area, expected, 5e-3 * expected);
}

// A patch emitting radiance 1 in all directions, seen by camera rays and by its points sampling the lens, must give the
// same mean and the same moments on the film. Both are averages over lattices of 512^2 points (error below 0.2 %).
TEST_P(CameraImportance, LightTracingMeetsTheCamerasRays) {
  const Transform& to_world = GetParam().settings.to_world;
  const Vec3 corner = to_world.point({-0.3f, -0.2f, 1.4f}), e1 = to_world.vector({0.8f, 0.1f, 0.4f});
  const Vec3 e2 = to_world.vector({-0.1f, 0.7f, 0.3f}), area = cross(e1, e2);
  const Vec3 n = normalize(area), axis = normalize(to_world.normal({0, 0, 1}));
  constexpr int kPoints = 1 << 18;
  constexpr double kG = 1.16730397826141868426;  // positive root of x^5 = x + 1: a lattice in four dimensions
  struct Moments {
    double sum = 0, x = 0, y = 0;
  } seen, traced, planted;
  for (int i = 0; i < kPoints; ++i) {
    float u[4];
    double step = 1;
    for (float& coordinate : u) {
      step /= kG;
      const double value = 0.5 + step * i;
      coordinate = std::min(static_cast<float>(value - std::floor(value)), kOneMinusEpsilon);
    }
    const Vec2 film{u[0] * width(), u[1] * height()};
    const Ray ray = camera_.ray(film, {u[2], u[3]});
    const float t = dot(corner - ray.o, n) / dot(ray.d, n);
    const Vec3 q = ray.at(t) - corner;
    const double a = dot(cross(q, e2), n) / length(area), b = dot(cross(e1, q), n) / length(area);
    if (t > 0 && a >= 0 && a < 1 && b >= 0 && b < 1) {
      const double weight = width() * height();
      seen.sum += weight, seen.x += weight * film.x, seen.y += weight * film.y;
    }
    const Vec3 p = corner + e1 * u[0] + e2 * u[1];
    const LensSample s = camera_.sample_towards(p, {u[2], u[3]});
    ASSERT_GT(s.pdf_solid_angle, 0);
    if (!in_frame(s.film)) continue;
    const double weight = length(area) * std::abs(dot(s.wi, n)) * s.importance / s.pdf_solid_angle;
    planted.sum += weight * dot(-s.wi, axis);  // one cosine too many
    traced.sum += weight, traced.x += weight * s.film.x, traced.y += weight * s.film.y;
  }
  EXPECT_GT(seen.sum / kPoints, 20);  // pixels
  EXPECT_NEAR(traced.sum / seen.sum, 1, 4e-3);
  EXPECT_LT(planted.sum / seen.sum, 0.99);
  EXPECT_NEAR(traced.x / traced.sum, seen.x / seen.sum, 4e-3 * width());
  EXPECT_NEAR(traced.y / traced.sum, seen.y / seen.sum, 4e-3 * height());
}

TEST_P(CameraImportance, LensSamplesAgreeWithTheirDensities) {
  const Vec3 reference = GetParam().settings.to_world.point({0.2f, 0.3f, 4});
  const Vec3 axis = normalize(GetParam().settings.to_world.normal({0, 0, 1}));
  for (int i = 0; i < 200; ++i) {
    const Vec2 u = PathRandom(Sampling::kIndependent, 6, 0, 0, i).get_2d(0, Event::kLens);
    const LensSample s = camera_.sample_towards(reference, u);
    EXPECT_LT(length(reference + s.wi * s.distance - s.p), 1e-5f);
    const Vec3 out = -s.wi;
    EXPECT_EQ(s.pdf_direction, camera_.pdf_direction(out));
    const float cosine = dot(out, axis), d2 = s.distance * s.distance;
    const float geometry = camera_.is_delta() ? 1 : d2 / cosine;
    EXPECT_NEAR(s.pdf_solid_angle, camera_.pdf_position() * geometry, 1e-4f * s.pdf_solid_angle);
    EXPECT_NEAR(s.importance, camera_.importance(out) * (camera_.is_delta() ? cosine / d2 : 1), 1e-4f * s.importance);
    const Ray ray = camera_.ray(s.film, u);
    EXPECT_LT(length(cross(ray.d, reference - ray.o)), 2e-4f);
    EXPECT_LT(length(ray.o - s.near_p), 2e-4f);
  }
}

TEST_P(CameraImportance, SeesNothingBeyondTheClipPlanes) {
  const auto pdf = [&](float z) {
    return camera_.sample_towards(GetParam().settings.to_world.point({0.01f, 0, z}), {0.4f, 0.7f}).pdf_solid_angle;
  };
  EXPECT_EQ(pdf(0.19f), 0);
  EXPECT_GT(pdf(0.21f), 0);
  EXPECT_GT(pdf(49.9f), 0);
  EXPECT_EQ(pdf(50.1f), 0);
  EXPECT_EQ(pdf(-1), 0);
  EXPECT_EQ(camera_.pdf_direction(-normalize(GetParam().settings.to_world.vector({0, 0, 1}))), 0);
}

TEST_P(CameraImportance, LensPointsAreUniform) {
  if (camera_.is_delta()) return;
  const Transform& to_world = GetParam().settings.to_world;
  const Transform to_local = to_world.inverse();
  const float radius = GetParam().settings.aperture_radius;
  const auto result = statistics::chi2_square(
      [&](const PathRandom& random) -> std::optional<Vec2> {
        const LensSample s = camera_.sample_towards(to_world.point({0, 0, 5}), random.get_2d(0, Event::kLens));
        const Vec3 local = to_local.point(s.p) * (1 / radius);
        EXPECT_NEAR(local.z, 0, 1e-5f);
        const float phi = std::atan2(local.y, local.x) / kTwoPi;  // area-preserving map of the disk
        return Vec2{std::min(local.x * local.x + local.y * local.y, kOneMinusEpsilon),
                    std::min(phi < 0 ? phi + 1 : phi, kOneMinusEpsilon)};
      },
      [](const Vec2&) { return 1.0; }, {.name = GetParam().name, .n_samples = 100000, .n_cells = 64});
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_NEAR(camera_.pdf_position(), 1 / (kPi * radius * radius), 2e-2f * camera_.pdf_position());
}

INSTANTIATE_TEST_SUITE_P(Cameras, CameraImportance, testing::ValuesIn(kCases),
                         [](const auto& test) { return std::string(test.param.name); });

}  // namespace
}  // namespace covary
