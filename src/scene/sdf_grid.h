// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "scene/analytic_shape.h"

namespace covary {

/// Signed distances (positive outside) at the grid points over [0, 1]^3.
struct SdfValues {
  int size[3] = {0, 0, 0};    ///< grid points along x, y, z; at least 2
  std::vector<float> values;  ///< values[(z * size[1] + y) * size[0] + x]

  float at(int x, int y, int z) const {
    return values[(static_cast<size_t>(z) * size[1] + static_cast<size_t>(y)) * size[0] + static_cast<size_t>(x)];
  }
};

/// The zero level set of signed distances, interpolated between grid points (see sdf_grid.cpp), under `to_world`. It
/// has no surface parameters and cannot emit light.
class SdfGrid final : public AnalyticShape {
 public:
  /// `smooth`: interpolate shading normals between cells. Throws Error(kInput) if no cell contains a surface.
  SdfGrid(const Transform& to_world, SdfValues grid, bool smooth, bool flip_normals);

  float intersect(const Ray& ray) const override;
  Bounds3 bounds() const override { return to_world_.bounds(local_bounds_); }
  void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const override;
  float area() const override { return 0; }
  AreaSample sample_area(Vec2, float) const override { return {}; }
  bool can_emit() const override { return false; }
  std::shared_ptr<Shape> transformed(const Transform& to_world) const override;

 private:
  struct Cell {
    int i[3];
  };
  /// The nearest zero within a cell, as a ray parameter in units of cells, in [near, far]; infinity: none.
  float zero_in(const Cell& cell, const Vec3& o, const Vec3& d, float near, float far) const;
  float value(const Vec3& p) const;  // p in units of cells, clamped to the grid
  Vec3 gradient(const Vec3& p, const int (&cell)[3]) const;
  Vec3 smooth_normal(const Vec3& p) const;
  Vec3 to_cells(const Vec3& local) const { return {local.x * cells_.x, local.y * cells_.y, local.z * cells_.z}; }

  Transform to_world_, to_local_;
  Vec3 size_;  // in the world, along each axis
  SdfValues grid_;
  Vec3 cells_;  // numbers of cells
  Bounds3 local_bounds_;
  bool smooth_, flipped_;
};

}  // namespace covary
