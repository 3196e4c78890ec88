// SPDX-License-Identifier: Apache-2.0
// Signed distance grids with known surfaces: a plane, where the interpolation is exact, and a sphere.
#include "scene/sdf_grid.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace covary {
namespace {

template <typename Distance>
SdfValues grid(int nx, int ny, int nz, const Distance& distance) {
  SdfValues result{{nx, ny, nz}, {}};
  for (int z = 0; z < nz; ++z)
    for (int y = 0; y < ny; ++y)
      for (int x = 0; x < nx; ++x)
        result.values.push_back(distance(Vec3{static_cast<float>(x) / static_cast<float>(nx - 1),
                                              static_cast<float>(y) / static_cast<float>(ny - 1),
                                              static_cast<float>(z) / static_cast<float>(nz - 1)}));
  return result;
}

SurfaceHit hit_of(const SdfGrid& shape, const Ray& ray) {
  SurfaceHit hit;
  hit.t = shape.intersect(ray);
  if (hit.t < kInfinity) shape.fill(ray, hit, true);
  return hit;
}

TEST(SdfGrid, PlaneIsExact) {
  const Vec3 n = normalize(Vec3{1, 2, 3});
  const Transform to_world = Transform::translate({1, 0, 0}) * Transform::scale({2, 2, 2});
  for (const bool smooth : {false, true}) {
    const SdfGrid plane(to_world,
                        grid(4, 6, 5,
                             [&](const Vec3& p) {
                               return dot(p - Vec3{0.5f, 0.5f, 0.5f}, n);
                             }),
                        smooth, false);
    const Ray ray{{2.1f, 0.9f, 9}, {0, 0, -1}, kInfinity};
    const SurfaceHit hit = hit_of(plane, ray);
    ASSERT_LT(hit.t, kInfinity);
    EXPECT_NEAR(dot(hit.p - Vec3{2, 1, 1}, n), 0, 1e-5f);
    EXPECT_LT(length(hit.ng - n), 1e-3f);
    EXPECT_LT(length(hit.frame.n - n), 1e-3f) << smooth;
    // From below, and from a point between the surface and the boundary.
    EXPECT_NEAR(hit_of(plane, {{2.1f, 0.9f, -9}, {0, 0, 1}, kInfinity}).p.z, hit.p.z, 1e-4f);
    EXPECT_EQ(plane.intersect({hit.p + n * 1e-2f, {0, 0, 1}, kInfinity}), kInfinity);
    EXPECT_EQ(plane.intersect({ray.o, ray.d, hit.t * 0.99f}), kInfinity);
  }
}

TEST(SdfGrid, SphereFromEverywhere) {
  const SdfGrid sphere(Transform(),
                       grid(33, 33, 33,
                            [](const Vec3& p) {
                              return length(p - Vec3{0.5f, 0.5f, 0.5f}) - 0.3f;
                            }),
                       true, false);
  EXPECT_NEAR(sphere.bounds().lower.x, 0.1875f, 1e-6f);
  for (int i = 0; i < 200; ++i) {
    const float z = -1 + 2 * (static_cast<float>(i) + 0.5f) / 200, phi = 2.4f * static_cast<float>(i);
    const Vec3 d{std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z};
    const Ray ray{Vec3{0.5f, 0.5f, 0.5f} + d * 3, -d, kInfinity};
    const SurfaceHit hit = hit_of(sphere, ray);
    EXPECT_NEAR(hit.t, 2.7f, 2e-3f) << i;
    EXPECT_GT(dot(hit.frame.n, d), 0.998f) << i;
    EXPECT_NEAR(hit_of(sphere, {{0.5f, 0.5f, 0.5f}, d, kInfinity}).t, 0.3f, 2e-3f) << i;
  }
  EXPECT_EQ(sphere.intersect({{0.9f, 0.9f, 3}, {0, 0, -1}, kInfinity}), kInfinity);
}

TEST(SdfGrid, NeedsASurface) {
  EXPECT_THROW(SdfGrid(Transform(), grid(3, 3, 3, [](const Vec3&) { return 1.0f; }), true, false), Error);
  EXPECT_THROW(SdfGrid(Transform(), grid(3, 1, 3, [](const Vec3& p) { return p.x - 0.5f; }), true, false), Error);
}

}  // namespace
}  // namespace covary
