// SPDX-License-Identifier: Apache-2.0
// Rays that leave a surface, or end at one, wherever it stands and whatever its size: they never hit it again, and meet
// a second surface that is 20 spacings of floats away, in either direction.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <string>

#include "core/random.h"
#include "core/warp.h"
#include "scene/analytic_shape.h"
#include "scene/curve.h"
#include "scene/mesh.h"
#include "scene/scene.h"
#include "scene/sdf_grid.h"

namespace covary {
namespace {

constexpr int kRays = 4000;

class BlackBsdf final : public Bsdf {
 public:
  uint32_t flags() const override { return 0; }
  const BsdfClosure* bind(const SurfaceHit&, bool, TransportMode, Arena&) const override { return nullptr; }
  Spectrum albedo(const SurfaceHit&) const override { return {}; }
};

/// Where a shape of about unit size is put.
struct Place {
  float distance, scale;
  Transform to_world() const {
    return Transform::translate(Vec3{1, -0.7f, 0.4f} * distance) * Transform::rotate({1, 2, 3}, 40) *
           Transform::scale({scale, scale, scale});
  }
  /// The spacing of floats at the largest coordinate of the shape and of the rays that come to it.
  float spacing() const {
    const float largest = distance + 4 * scale;
    return std::nextafter(largest, kInfinity) - largest;
  }
  std::string text() const { return std::to_string(scale) + " large, " + std::to_string(distance) + " away"; }
};

const Place kPlaces[] = {{0, 1},    {10, 1},    {1000, 1},   {1e5f, 1},   {0, 1e-3f},
                         {0, 1e3f}, {1e3, 1e3}, {10, 1e-3f}, {1e5f, 1e4f}};

std::shared_ptr<TriangleMesh> triangle(const Transform& to_world) {
  MeshData data;  // a sliver of no special direction
  for (const Vec3& p : {Vec3{-1, -0.9f, 0}, Vec3{1.1f, -1, 0}, Vec3{0.9f, -0.6f, 0}})
    data.positions.push_back(to_world.point(p));
  data.triangles = {{0, 1, 2}};
  const auto mesh = std::make_shared<TriangleMesh>(std::move(data));
  mesh->prepare_sampling();
  return mesh;
}

std::shared_ptr<TriangleMesh> parallelogram(const Transform& to_world) {
  MeshData data;
  for (const Vec2 p : {Vec2{0, 0}, Vec2{1, 0}, Vec2{1, 1}, Vec2{0, 1}}) {
    data.positions.push_back(to_world.point({2 * p.x - 1, 2 * p.y - 1, 0}));
    data.uvs.push_back(p);
  }
  data.triangles = {{0, 1, 2}, {0, 2, 3}};
  const auto mesh = std::make_shared<TriangleMesh>(std::move(data));
  mesh->prepare_sampling();
  return mesh;
}

std::shared_ptr<CurveShape> tube(const Transform& to_world, CurveKind kind) {
  const float r = 0.1f * length(to_world.vector({1, 0, 0}));
  std::vector<CurvePoint> points;
  for (int i = 0; i < 4; ++i) {
    const Vec3 p = to_world.point({-1 + 0.7f * static_cast<float>(i), 0, 0});
    points.push_back({p.x, p.y, p.z, r});
  }
  const std::vector<uint32_t> segments =
      kind == CurveKind::kLinear ? std::vector<uint32_t>{0, 1, 2} : std::vector<uint32_t>{0};
  return std::make_shared<CurveShape>(kind, std::move(points), segments);
}

/// The plane z = 0.4 of the unit cube.
std::shared_ptr<SdfGrid> plane_of_distances(const Transform& to_world) {
  SdfValues grid;
  grid.size[0] = grid.size[1] = 4, grid.size[2] = 3;
  for (int z = 0; z < 3; ++z)
    for (int i = 0; i < 16; ++i) grid.values.push_back(static_cast<float>(z) * 0.5f - 0.4f);
  return std::make_shared<SdfGrid>(to_world, std::move(grid), false, false);
}

using MakeShape = std::function<std::shared_ptr<Shape>(const Transform&)>;
struct Kind {
  const char* name;
  MakeShape make;
};

const Kind kFlat[] = {
    {"triangle", triangle},
    {"parallelogram", parallelogram},
    {"disk", [](const Transform& t) { return std::make_shared<Disk>(t, false); }},
    {"signed distances", plane_of_distances},
};
const Kind kRound[] = {
    {"sphere", [](const Transform& t) { return std::make_shared<Sphere>(t, Vec3{}, 1.0f, false); }},
    {"cylinder", [](const Transform& t) { return std::make_shared<Cylinder>(t, false); }},
    {"linear curve", [](const Transform& t) { return tube(t, CurveKind::kLinear); }},
    {"B-spline", [](const Transform& t) { return tube(t, CurveKind::kBspline); }},
};

/// A scene of shapes, or of one instance of them at `placed`.
std::unique_ptr<Scene> scene_of(std::vector<std::shared_ptr<Shape>> shapes, const Transform* placed = nullptr) {
  SceneParts parts;
  for (const auto& shape : shapes) shape->set_bsdf(std::make_shared<BlackBsdf>());
  if (placed) {
    auto group = std::make_shared<ShapeGroup>();
    group->shapes.assign(shapes.begin(), shapes.end());
    parts.instances.push_back({group, *placed});
  } else {
    parts.shapes.assign(shapes.begin(), shapes.end());
  }
  parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
  return std::make_unique<Scene>(std::move(parts));
}

/// Calls visit(hit, the ray's direction, two numbers) for the hits of rays to the unit cube at `place` from all sides.
template <typename Visit>
int for_each_hit(const Scene& scene, const Place& place, const Visit& visit) {
  int n_hits = 0;
  for (uint64_t i = 0; i < kRays; ++i) {
    const PathRandom random(Sampling::kIndependent, 1, 0, 0, i);
    const Transform to_world = place.to_world();
    const Vec3 from = warp::square_to_sphere(random.get_2d(0, Event::kLens)) * 3.0f;
    const Vec2 u = random.get_2d(0, Event::kPixel);
    const Vec3 to = Vec3{u.x, u.y, random.get_1d(0, Event::kLobe)} * 2.0f - Vec3{1, 1, 1};
    const Vec3 o = to_world.point(from);
    const Ray ray{o, normalize(to_world.vector(to - from))};
    SurfaceHit hit;
    if (!scene.intersect(ray, hit)) continue;
    ++n_hits;
    visit(hit, ray.d, random.get_2d(1, Event::kDirection));
  }
  return n_hits;
}

/// A direction to the side of the surface that `side` points to; few are grazing.
Vec3 direction_to(const Vec3& ng, const Vec3& side, Vec2 u) {
  return Frame(dot(ng, side) > 0 ? ng : -ng).to_world(warp::square_to_cosine_hemisphere(u));
}

/// Fraction of the rays to the outside of a convex shape, and for flat ones to the inside, that hit it again.
double hit_again(const Scene& scene, const Place& place, bool both_sides) {
  int n = 0, n_again = 0;
  for_each_hit(scene, place, [&](const SurfaceHit& hit, const Vec3& d, Vec2 u) {
    for (const Vec3& side : {-d, d}) {
      if (!both_sides && dot(side, hit.ng) < 0) continue;
      const Vec3 w = direction_to(hit.ng, side, u);
      SurfaceHit again;
      ++n, n_again += scene.intersect({offset_origin(hit, w), w, kInfinity}, again);
    }
  });
  EXPECT_GT(n, 100);
  return static_cast<double>(n_again) / n;
}

TEST(RayOrigins, RaysDoNotHitTheSurfaceThatTheyLeave) {
  for (const Place& place : kPlaces) {
    const Transform to_world = place.to_world();
    for (const auto& [kinds, flat] : {std::pair{std::span(kFlat), true}, std::pair{std::span(kRound), false}})
      for (const Kind& kind : kinds) {
        SCOPED_TRACE(std::string(kind.name) + ", " + place.text());
        EXPECT_EQ(hit_again(*scene_of({kind.make(to_world)}), place, flat), 0);
        EXPECT_EQ(hit_again(*scene_of({kind.make(Transform())}, &to_world), place, flat), 0) << "instance";
      }
  }
}

/// Of the rays that go on through the first of two parallel surfaces, those that miss the second though they leave
/// within its border.
TEST(RayOrigins, ASecondSurfaceTwentySpacingsAwayIsMet) {
  for (const Place& place : kPlaces) {
    if (20 * place.spacing() > 0.5f * place.scale) continue;  // nothing of it is left there
    const Transform to_world = place.to_world();
    const float gap = 20 * place.spacing() / place.scale;
    for (const Kind& kind : std::span(kFlat).subspan(1)) {  // the plane of a sliver is less certain
      const Transform behind = Transform::translate({0, 0, -gap});
      for (const bool instanced : {false, true}) {
        SCOPED_TRACE(std::string(kind.name) + (instanced ? " as an instance, " : ", ") + place.text());
        const Transform at = instanced ? Transform() : to_world;
        const auto scene = scene_of({kind.make(at), kind.make(at * behind)}, instanced ? &to_world : nullptr);
        int n = 0, n_missed = 0;
        for_each_hit(*scene, place, [&](const SurfaceHit& hit, const Vec3& d, Vec2) {
          if (std::abs(dot(hit.ng, d)) < 0.5f) return;
          SurfaceHit next;
          ++n, n_missed += !scene->intersect({offset_origin(hit, d), d, kInfinity}, next) || next.shape == hit.shape;
        });
        EXPECT_GT(n, 50);
        // The borders are displaced by up to two gaps.
        EXPECT_LT(n_missed, 0.02 * n + 8 * static_cast<double>(n) * gap);
      }
    }
  }
}

TEST(RayOrigins, ShadowRaysEndBetweenALightAndItsShade) {
  for (const Place& place : kPlaces) {
    if (20 * place.spacing() > 0.1f * place.scale) continue;
    const Transform to_world = place.to_world();
    const float gap = 20 * place.spacing() / place.scale;
    for (const auto& [kind, flat] : {std::pair{kFlat[1], true}, std::pair{kFlat[2], true}, std::pair{kRound[0], false},
                                     std::pair{kRound[1], false}}) {
      SCOPED_TRACE(std::string(kind.name) + ", " + place.text());
      const auto light = kind.make(to_world);
      const Transform shade = flat ? Transform::translate({0, 0, gap}) * Transform::scale({1.2f, 1.2f, 1})
                                   : Transform::scale({1 + gap, 1 + gap, 1 + gap});
      const auto open = scene_of({light}), shaded = scene_of({kind.make(to_world * shade)});
      int n = 0, n_blocked = 0, n_through = 0;
      for (uint64_t i = 0; i < kRays; ++i) {
        const PathRandom random(Sampling::kIndependent, 1, 0, 0, i);
        const Vec3 local = warp::square_to_sphere(random.get_2d(0, Event::kLens)) * 3.0f;
        if (flat && local.z < 1) continue;
        const Vec3 from = to_world.point(local);
        const EmitterSample at = light->sample_towards(from, random.get_2d(1, Event::kLightPosition),
                                                       random.get_1d(1, Event::kLightPrimitive));
        if (!(at.pdf_solid_angle > 0) || !(dot(at.n, at.wi) < -0.05f)) continue;
        const Ray ray = ray_between(from, offset_target(at.p, at.n, at.offset, at.wi, at.distance));
        ++n, n_blocked += open->occluded(ray), n_through += !shaded->occluded(ray);
      }
      EXPECT_GT(n, 400);
      EXPECT_EQ(n_blocked, 0) << "by the light itself";
      // Near its border a shade of the light's own outline lets light in: within 20 gaps at these angles.
      EXPECT_LE(n_through, 1e-3 * n + 100 * static_cast<double>(n) * gap) << "through the shade";
    }
  }
}

/// Where nothing is between a point and a light, the ray is empty, and nothing blocks it; no number in it is NaN.
TEST(RayOrigins, ARayOfNoLengthIsNotBlocked) {
  const auto scene = scene_of({std::make_shared<Disk>(Transform(), false)});
  const Ray ray = ray_between({0, 0, 0.5f}, {0, 0, 0.5f});
  EXPECT_EQ(ray.d, Vec3{});
  EXPECT_EQ(ray.t_max, 0);
  EXPECT_FALSE(scene->occluded(ray));
  SurfaceHit hit;
  EXPECT_FALSE(scene->intersect(ray, hit));
}

/// Embree's linear curves of such small segments were missed or too thick; a curve of one unit is the reference.
TEST(RayOrigins, LinearCurvesAreAsThickAtEverySize) {
  const auto n_hits = [](float scale) {
    const Place place{0, scale};
    return for_each_hit(*scene_of({tube(place.to_world(), CurveKind::kLinear)}), place,
                        [](const SurfaceHit&, const Vec3&, Vec2) {});
  };
  const int expected = n_hits(1);
  EXPECT_GT(expected, 100);
  for (const float scale : {1e-5f, 1e-4f, 1e-3f, 0.003f, 0.01f, 0.1f, 10.0f, 1e4f})
    EXPECT_NEAR(n_hits(scale), expected, 2) << scale;
}

}  // namespace
}  // namespace covary
