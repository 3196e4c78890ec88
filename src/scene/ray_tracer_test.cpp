// SPDX-License-Identifier: Apache-2.0
// Shapes in the ray tracer: hit positions, surface properties there, and consistency with sampling.
#include <gtest/gtest.h>

#include <atomic>
#include <functional>
#include <memory>
#include <thread>

#include "core/error.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/stop.h"
#include "scene/analytic_shape.h"
#include "scene/curve.h"
#include "scene/mesh.h"
#include "scene/scene.h"

namespace covary {
namespace {

/// Black; asks for derivatives so that every field of a hit is filled.
class BlackBsdf final : public Bsdf {
 public:
  uint32_t flags() const override { return 0; }
  const BsdfClosure* bind(const SurfaceHit&, bool, TransportMode, Arena&) const override { return nullptr; }
  bool needs_derivatives() const override { return true; }
  Spectrum albedo(const SurfaceHit&) const override { return {}; }
};

std::unique_ptr<Scene> scene_of(std::vector<ShapePtr> shapes, std::vector<Instance> instances = {}) {
  const auto bsdf = std::make_shared<BlackBsdf>();
  for (const ShapePtr& shape : shapes) shape->set_bsdf(bsdf);
  for (const Instance& instance : instances)
    for (const ShapePtr& shape : instance.group->shapes) shape->set_bsdf(bsdf);
  SceneParts parts;
  parts.shapes = std::move(shapes);
  parts.instances = std::move(instances);
  parts.camera = std::make_shared<Camera>(CameraSettings{}, 4, 4);
  return std::make_unique<Scene>(std::move(parts));
}

void expect_near(const Vec3& a, const Vec3& b, float tolerance = 2e-5f) {
  EXPECT_LT(length(a - b), tolerance) << "(" << a.x << ", " << a.y << ", " << a.z << ") and (" << b.x << ", " << b.y
                                      << ", " << b.z << ")";
}

/// Compares (dp_du, dp_dv) with finite differences of the point as a function of (u, v) at nearby hits.
void expect_derivatives(const Scene& scene, const Ray& ray) {
  SurfaceHit at;
  ASSERT_TRUE(scene.intersect(ray, at));
  for (const Vec3& side : {at.frame.s, at.frame.t}) {
    SurfaceHit near_hit;
    Ray shifted = ray;
    shifted.d = normalize(ray.d + side * 1e-3f);
    ASSERT_TRUE(scene.intersect(shifted, near_hit));
    const Vec2 duv = near_hit.uv - at.uv;
    const Vec3 moved = near_hit.p - at.p;
    EXPECT_LT(length(at.dp_du * duv.x + at.dp_dv * duv.y - moved), 0.03f * length(moved));
  }
}

TEST(RayTracer, SphereFromOutsideAndInside) {
  const auto sphere = std::make_shared<Sphere>(Transform::rotate({1, 2, 3}, 40) * Transform::translate({1, 0, 0}),
                                               Vec3{0, 0, 0}, 2.0f, false);
  const auto scene = scene_of({sphere});
  const Vec3 centre = (Transform::rotate({1, 2, 3}, 40)).point({1, 0, 0});
  SurfaceHit hit;
  ASSERT_TRUE(scene->intersect({centre + Vec3{0, 0, 5}, {0, 0, -1}}, hit));
  EXPECT_NEAR(hit.t, 3, 1e-5f);
  expect_near(hit.p, centre + Vec3{0, 0, 2});
  expect_near(hit.ng, {0, 0, 1});
  ASSERT_TRUE(scene->intersect({centre, {0, 1, 0}}, hit));
  EXPECT_NEAR(hit.t, 2, 1e-5f);
  expect_near(hit.ng, {0, 1, 0});
  EXPECT_FALSE(scene->intersect({centre + Vec3{0, 0, 5}, {0, 0, 1}}, hit));
  EXPECT_TRUE(scene->occluded({centre + Vec3{0, 0, 5}, {0, 0, -1}, 3.1f}));
  EXPECT_FALSE(scene->occluded({centre + Vec3{0, 0, 5}, {0, 0, -1}, 2.9f}));
  expect_derivatives(*scene, {centre + Vec3{0.3f, 0.4f, 5}, normalize(Vec3{0.1f, 0.05f, -1})});
}

#ifndef COVARY_PLAIN_THREADS
/// Calls f on a stack that is n frames deeper, so that nothing lies where it lay before.
__attribute__((noinline)) bool call_deeper(int n, const std::function<bool()>& f) {
  volatile char frame[1024];
  for (volatile char& c : frame) c = 1;
  return n > 0 ? call_deeper(n - 1, f) && frame[n] : f();
}

/// A scene outlives the work that loaded it, and other work is stopped: Embree's task group must not have kept the
/// context of the first, which TBB follows to find out what the stop concerns. It did, and the process crashed.
TEST(RayTracer, OutlivesTheWorkThatMadeIt) {
  std::unique_ptr<Scene> scene;
  const std::atomic<bool> never{false};
  ASSERT_TRUE(run_stoppable(&never, [&] {
    const std::vector<CurvePoint> points{{3, 0, 0, 1e-3f}, {3.01f, 0, 0, 1e-3f}};  // a scene of its own in Embree
    scene = scene_of({std::make_shared<Sphere>(Transform(), Vec3{0, 0, 0}, 1.0f, false),
                      std::make_shared<CurveShape>(CurveKind::kLinear, points, std::vector<uint32_t>{0})});
  }));
  for (int i = 0; i < 20; ++i) {
    std::atomic<bool> stop{false};
    EXPECT_FALSE(call_deeper(1 + i % 5, [&] {
      return run_stoppable(&stop, [&] {
        stop = true;
        for (;;) parallel_for(2, [](int) { std::this_thread::yield(); });
      });
    }));
  }
  EXPECT_TRUE(scene->occluded({{0, 0, 5}, {0, 0, -1}, 10}));
}
#endif

TEST(RayTracer, DiskRespectsItsEdgeAndOrientation) {
  const auto disk = std::make_shared<Disk>(Transform::translate({0, 0, 1}) * Transform::scale({2, 1, 1}), true);
  const auto scene = scene_of({disk});
  SurfaceHit hit;
  ASSERT_TRUE(scene->intersect({{1.9f, 0, 3}, {0, 0, -1}}, hit));
  expect_near(hit.ng, {0, 0, -1});
  EXPECT_FALSE(scene->intersect({{0, 1.1f, 3}, {0, 0, -1}}, hit));
  EXPECT_NEAR(disk->area(), 2 * kPi, 1e-5f);
  expect_derivatives(*scene, {{0.5f, 0.3f, 3}, normalize(Vec3{0.1f, 0, -1})});
}

// Mitsuba 3.9.1, scalar_rgb: the points u = 0 and u = 0.25, v = 0.5 of cylinders of radius 1 from the origin.
TEST(RayTracer, CylinderHasTheTextureCoordinatesOfMitsuba) {
  struct Case {
    Vec3 axis, at_0, at_quarter;
  };
  for (const Case& c : {Case{{0, 0, 1}, {1, 0, 0.5f}, {0, 1, 0.5f}}, Case{{0, 0, -1}, {1, 0, -0.5f}, {0, -1, -0.5f}},
                        Case{{0, 1, 0}, {1, 0.5f, 0}, {0, 0.5f, -1}},
                        Case{{2.0f / 3, -1.0f / 3, -2.0f / 3}, {1.06667f, -0.033333f, 0.333333f}, {0.2f, -1.1f, 0}},
                        Case{{0.6f, 0, 0.8f}, {1.1f, 0, -0.2f}, {0.3f, 1, 0.4f}},
                        Case{{0.48f, 0.64f, -0.6f}, {1.096f, 0.128f, 0.18f}, {0.432f, -0.424f, -0.94f}}}) {
    const Cylinder cylinder(Transform(), Vec3(0), c.axis, 1, false);
    EXPECT_LT(length(cylinder.sample_area({0, 0.5f}, 0).p - c.at_0), 1e-5f);
    EXPECT_LT(length(cylinder.sample_area({0.25f, 0.5f}, 0).p - c.at_quarter), 1e-5f);
  }
}

TEST(RayTracer, CylinderIsOpenAtBothEnds) {
  const auto cylinder = std::make_shared<Cylinder>(Transform(), Vec3{0, 0, -1}, Vec3{0, 0, 2}, 0.5f, false);
  const auto scene = scene_of({cylinder});
  SurfaceHit hit;
  ASSERT_TRUE(scene->intersect({{3, 0, 0.5f}, {-1, 0, 0}}, hit));
  EXPECT_NEAR(hit.t, 2.5f, 1e-5f);
  expect_near(hit.ng, {1, 0, 0});
  EXPECT_NEAR(hit.uv.y, 0.5f, 1e-5f);
  EXPECT_FALSE(scene->intersect({{0.1f, 0, 5}, {0, 0, -1}}, hit));
  EXPECT_FALSE(scene->intersect({{3, 0, 2.1f}, {-1, 0, 0}}, hit));
  EXPECT_NEAR(cylinder->area(), kTwoPi * 0.5f * 3, 1e-4f);
  expect_derivatives(*scene, {{3, 0.1f, 0.5f}, normalize(Vec3{-1, 0, 0.1f})});
}

TEST(RayTracer, InstancesArePlacedCopies) {
  MeshData data;
  data.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}};
  data.uvs = {{0, 0}, {1, 0}, {0.5f, 1}};
  data.triangles = {{0, 1, 2}};
  auto group = std::make_shared<ShapeGroup>();
  group->shapes = {std::make_shared<TriangleMesh>(data),
                   std::make_shared<Sphere>(Transform(), Vec3{0, 0, -3}, 1.0f, false)};
  const Transform place =
      Transform::translate({10, 0, 0}) * Transform::rotate({0, 1, 0}, 90) * Transform::scale({2, 2, 2});
  const auto scene = scene_of({}, {{group, Transform()}, {group, place}});
  SurfaceHit hit;
  ASSERT_TRUE(scene->intersect({{0, 0, 5}, {0, 0, -1}}, hit));
  expect_near(hit.p, {0, 0, 0});
  ASSERT_TRUE(scene->intersect({{15, 0, 0}, {-1, 0, 0}}, hit));  // the plane z = 0 turned towards +x
  expect_near(hit.p, {10, 0, 0});
  expect_near(hit.ng, {1, 0, 0});
  expect_near(hit.dp_du, place.vector({2, 0, 0}));
  EXPECT_NEAR(hit.t, 5, 1e-5f);
  ASSERT_TRUE(scene->intersect({{-5, 0, 0}, {1, 0, 0}}, hit));  // the sphere, at x = 10 - 6 with radius 2
  expect_near(hit.p, {2, 0, 0});
  EXPECT_EQ(scene->n_triangles(), 2u);
}

/// Every sampled point is where a ray in the sampled direction first hits the shape, and both densities agree.
void expect_sampling_agrees(const std::shared_ptr<Shape>& shape, const Vec3& reference, bool nearest_only) {
  const auto scene = scene_of({shape});
  int visible = 0;
  for (uint64_t i = 0; i < 200; ++i) {
    const PathRandom random(Sampling::kIndependent, 1, 0, 0, i);
    const EmitterSample sample = shape->sample_towards(reference, random.get_2d(1, Event::kLightPosition),
                                                       random.get_1d(1, Event::kLightPrimitive));
    ASSERT_GT(sample.pdf_solid_angle, 0);
    expect_near(reference + sample.wi * sample.distance, sample.p, 1e-4f);
    SurfaceHit hit;
    ASSERT_TRUE(scene->intersect({reference, sample.wi}, hit)) << i;
    if (!nearest_only && std::abs(hit.t - sample.distance) > 1e-3f) continue;  // a farther point on the shape
    ++visible;
    expect_near(hit.p, sample.p, 2e-4f);
    expect_near(hit.ng, sample.n, 1e-3f);
    EXPECT_NEAR(hit.uv.x, sample.uv.x, 2e-3f);
    EXPECT_NEAR(hit.uv.y, sample.uv.y, 2e-3f);
    EXPECT_NEAR(shape->pdf_solid_angle(reference, hit) / sample.pdf_solid_angle, 1,
                5e-3f);  // single precision at grazing angles
  }
  EXPECT_GT(visible, 60);
}

TEST(ShapeSampling, AgreesWithRays) {
  expect_sampling_agrees(std::make_shared<Sphere>(Transform::rotate({1, 1, 0}, 30), Vec3{1, 2, 3}, 0.7f, false),
                         {4, -1, 0}, true);
  expect_sampling_agrees(std::make_shared<Sphere>(Transform(), Vec3{0, 0, 0}, 3.0f, true), {0.5f, 1, 0.2f}, true);
  expect_sampling_agrees(std::make_shared<Disk>(Transform::rotate({1, 1, 0}, 30) * Transform::scale({1, 2, 1}), false),
                         {1, 1, 3}, true);
  expect_sampling_agrees(
      std::make_shared<Cylinder>(Transform::rotate({1, 1, 0}, 30), Vec3{0, 0, 0}, Vec3{0, 1, 1}, 0.4f, false),
      {3, 1, 3}, false);
  MeshData data;
  data.positions = {{-1, -1, 0}, {1, -1, 0}, {0, 1, 0}, {0, 0, -1}};
  data.triangles = {{0, 1, 2}, {3, 1, 2}};
  const auto mesh = std::make_shared<TriangleMesh>(data);
  mesh->prepare_sampling();
  expect_sampling_agrees(mesh, {2, 1, 3}, false);
}

TEST(ShapeSampling, ConeOfASphereIsItsSolidAngle) {
  const Sphere sphere(Transform(), {0, 0, 0}, 1.0f, false);
  const EmitterSample sample = sphere.sample_towards({0, 0, 2}, {0.3f, 0.4f}, 0);
  const float cos_max = std::sqrt(1 - 0.25f);
  EXPECT_NEAR(1 / sample.pdf_solid_angle, kTwoPi * (1 - cos_max), 1e-5f);
}

TEST(Sphere, RefusesUnevenScale) {
  try {
    const Sphere sphere(Transform::scale({1, 2, 1}), {0, 0, 0}, 1.0f, false);
    FAIL();
  } catch (const Error& error) {
    EXPECT_STREQ(error.what(), "the to_world transformation of a sphere must scale all axes alike, without shear");
  }
}

}  // namespace
}  // namespace covary
