// SPDX-License-Identifier: Apache-2.0
// Ray tracing of signed distance grids: H. Hansson-Söderlund, A. Evans, T. Akenine-Möller, "Ray Tracing of Signed
// Distance Function Grids", JCGT 11 (3), 2022. A ray steps through the cells; within one, the interpolated distance is
// a cubic polynomial in the ray parameter, which is split at its extrema and bisected. Shading normals follow the
// paper, too: gradients of the eight cells around a point, normalised and interpolated.
#include "scene/sdf_grid.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"

namespace covary {
namespace {

/// c[0] + c[1] t + c[2] t^2 + c[3] t^3.
struct Cubic {
  double c[4];
  double at(double t) const { return ((c[3] * t + c[2]) * t + c[1]) * t + c[0]; }
};

/// Multiplies a polynomial of degree `degree` by a + b t, in place.
void multiply(Cubic& p, int degree, double a, double b) {
  for (int k = degree + 1; k > 0; --k) p.c[k] = (k <= degree ? p.c[k] * a : 0) + p.c[k - 1] * b;
  p.c[0] *= a;
}

/// The first zero in [near, far], or infinity.
double first_zero(const Cubic& f, double near, double far) {
  double cuts[4] = {near, far, far, far};
  int n = 1;
  const double a = 3 * f.c[3], b = 2 * f.c[2], c = f.c[1];
  double roots[2];
  int n_roots = 0;
  if (std::abs(a) > 1e-12 * (std::abs(b) + std::abs(c))) {
    const double discriminant = b * b - 4 * a * c;
    if (discriminant > 0) {
      const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
      roots[0] = q / a, roots[1] = q != 0 ? c / q : 0;
      if (roots[0] > roots[1]) std::swap(roots[0], roots[1]);
      n_roots = 2;
    }
  } else if (b != 0) {
    roots[n_roots++] = -c / b;
  }
  for (int i = 0; i < n_roots; ++i)
    if (roots[i] > near && roots[i] < far) cuts[n++] = roots[i];
  cuts[n] = far;
  for (int i = 0; i < n; ++i) {
    double lower = cuts[i], upper = cuts[i + 1];
    const double f_lower = f.at(lower);
    if (f_lower * f.at(upper) > 0) continue;
    for (int step = 0; step < 40; ++step) {
      const double middle = 0.5 * (lower + upper);
      (f.at(middle) * f_lower > 0 ? lower : upper) = middle;
    }
    return upper;
  }
  return kInfinity;
}

}  // namespace

SdfGrid::SdfGrid(const Transform& to_world, SdfValues grid, bool smooth, bool flip_normals)
    : to_world_(to_world),
      to_local_(to_world.inverse()),
      grid_(std::move(grid)),
      cells_{static_cast<float>(grid_.size[0] - 1), static_cast<float>(grid_.size[1] - 1),
             static_cast<float>(grid_.size[2] - 1)},
      smooth_(smooth),
      flipped_(flip_normals) {
  if (*std::min_element(grid_.size, grid_.size + 3) < 2)
    throw Error(ErrorCode::kInput, "a grid of signed distances needs at least two values along each axis");
  for (int z = 0; z + 1 < grid_.size[2]; ++z)
    for (int y = 0; y + 1 < grid_.size[1]; ++y)
      for (int x = 0; x + 1 < grid_.size[0]; ++x) {
        bool positive = false, negative = false;
        for (int k = 0; k < 8; ++k) {
          const float v = grid_.at(x + (k & 1), y + (k >> 1 & 1), z + (k >> 2));
          positive |= v >= 0, negative |= v <= 0;
        }
        if (!positive || !negative) continue;
        const float fx = static_cast<float>(x), fy = static_cast<float>(y), fz = static_cast<float>(z);
        local_bounds_.extend(Vec3{fx / cells_.x, fy / cells_.y, fz / cells_.z});
        local_bounds_.extend(Vec3{(fx + 1) / cells_.x, (fy + 1) / cells_.y, (fz + 1) / cells_.z});
      }
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) size_[i] += static_cast<float>(std::abs(to_world_.matrix()[i][j]));
  if (local_bounds_.empty())
    throw Error(ErrorCode::kInput, "the signed distances have one sign throughout: there is no surface");
}

float SdfGrid::zero_in(const Cell& cell, const Vec3& o, const Vec3& d, float near, float far) const {
  const auto& [x, y, z] = cell.i;
  Cubic sum{};
  bool positive = false, negative = false;
  for (int k = 0; k < 8; ++k) {
    const int corner[3] = {k & 1, k >> 1 & 1, k >> 2};
    const float v = grid_.at(x + corner[0], y + corner[1], z + corner[2]);
    positive |= v >= 0, negative |= v <= 0;
    // The weight of a corner is a product of three linear functions, expanded around `near` for precision.
    Cubic term{{v, 0, 0, 0}};
    for (int axis = 0; axis < 3; ++axis) {
      const double p = double{o[axis]} + double{near} * d[axis] - cell.i[axis];
      multiply(term, axis, corner[axis] ? p : 1 - p, corner[axis] ? d[axis] : -d[axis]);
    }
    for (int i = 0; i < 4; ++i) sum.c[i] += term.c[i];
  }
  if (!positive || !negative) return kInfinity;
  return near + static_cast<float>(first_zero(sum, 0, double{far} - near));
}

float SdfGrid::intersect(const Ray& ray) const {
  const Vec3 o = to_cells(to_local_.point(ray.o)), d = to_cells(to_local_.vector(ray.d));
  float near = 0, far = ray.t_max;
  for (int axis = 0; axis < 3; ++axis) {
    if (d[axis] == 0) {
      if (o[axis] < 0 || o[axis] > cells_[axis]) return kInfinity;
      continue;
    }
    const float a = -o[axis] / d[axis], b = (cells_[axis] - o[axis]) / d[axis];
    near = std::max(near, std::min(a, b)), far = std::min(far, std::max(a, b));
  }
  if (!(near < far)) return kInfinity;
  Cell cell;
  float next[3], step[3];
  for (int axis = 0; axis < 3; ++axis) {
    const int last = grid_.size[axis] - 2;
    cell.i[axis] = std::clamp(static_cast<int>(o[axis] + near * d[axis]), 0, last);
    step[axis] = d[axis] != 0 ? 1 / std::abs(d[axis]) : kInfinity;
    const float border = static_cast<float>(cell.i[axis] + (d[axis] > 0 ? 1 : 0));
    next[axis] = d[axis] != 0 ? (border - o[axis]) / d[axis] : kInfinity;
  }
  for (float t = near; t < far;) {
    const int axis = next[0] < next[1] ? (next[0] < next[2] ? 0 : 2) : (next[1] < next[2] ? 1 : 2);
    const float end = std::min(std::max(next[axis], t), far);
    const float found = zero_in(cell, o, d, t, end);
    if (found > 0 && found < ray.t_max) return found;
    cell.i[axis] += d[axis] > 0 ? 1 : -1;
    if (cell.i[axis] < 0 || cell.i[axis] > grid_.size[axis] - 2) break;
    t = end;
    next[axis] += step[axis];
  }
  return kInfinity;
}

float SdfGrid::value(const Vec3& p) const {
  int i[3];
  float f[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float x = std::clamp(p[axis], 0.0f, cells_[axis]);
    i[axis] = std::min(static_cast<int>(x), grid_.size[axis] - 2);
    f[axis] = x - static_cast<float>(i[axis]);
  }
  float sum = 0;
  for (int k = 0; k < 8; ++k)
    sum += grid_.at(i[0] + (k & 1), i[1] + (k >> 1 & 1), i[2] + (k >> 2)) * (k & 1 ? f[0] : 1 - f[0]) *
           (k >> 1 & 1 ? f[1] : 1 - f[1]) * (k >> 2 ? f[2] : 1 - f[2]);
  return sum;
}

/// Gradient of the interpolation within a cell, in local coordinates.
Vec3 SdfGrid::gradient(const Vec3& p, const int (&cell)[3]) const {
  Vec3 g;
  for (int axis = 0; axis < 3; ++axis) {
    Vec3 lower = p, upper = p;
    lower[axis] = static_cast<float>(cell[axis]), upper[axis] = static_cast<float>(cell[axis] + 1);
    g[axis] = (value(upper) - value(lower)) * cells_[axis];
  }
  return g;
}

Vec3 SdfGrid::smooth_normal(const Vec3& p) const {
  int first[3];
  float f[3];
  for (int axis = 0; axis < 3; ++axis) {
    const float rounded = std::round(p[axis]);
    first[axis] = static_cast<int>(rounded) - 1;
    f[axis] = p[axis] - rounded + 0.5f;
    if (first[axis] < 0) f[axis] = 1;                         // no cells on that side
    if (first[axis] + 1 > grid_.size[axis] - 2) f[axis] = 0;  // nor on this one
  }
  Vec3 sum;
  for (int k = 0; k < 8; ++k) {
    const int upper[3] = {k & 1, k >> 1 & 1, k >> 2};
    float weight = 1;
    int cell[3];
    for (int axis = 0; axis < 3; ++axis) {
      weight *= upper[axis] ? f[axis] : 1 - f[axis];
      cell[axis] = first[axis] + upper[axis];
    }
    if (weight == 0) continue;
    const Vec3 g = gradient(p, cell);
    if (const float l = length(g); l > 0) sum += g * (weight / l);
  }
  return sum;
}

void SdfGrid::fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const {
  Vec3 p = to_cells(to_local_.point(ray.o) + to_local_.vector(ray.d) * hit.t);
  int cell[3];
  for (int axis = 0; axis < 3; ++axis) cell[axis] = std::clamp(static_cast<int>(p[axis]), 0, grid_.size[axis] - 2);
  const Vec3 slope = gradient(p, cell) * Vec3{1 / cells_.x, 1 / cells_.y, 1 / cells_.z};
  const float steepness = length_squared(slope);  // the distance found is a float: one step of Newton's method
  if (steepness > 0) p += slope * std::clamp(-value(p) / steepness, -0.5f, 0.5f);
  hit.p = to_world_.point({p.x / cells_.x, p.y / cells_.y, p.z / cells_.z});
  const float sign = flipped_ ? -1.0f : 1.0f;
  const auto to_normal = [&](const Vec3& local, const Vec3& otherwise) {
    const Vec3 n = to_world_.normal(local);
    const float l = length(n);
    return l > 0 ? n * (sign / l) : otherwise;
  };
  hit.ng = to_normal(gradient(p, cell), -normalize(ray.d));
  hit.offset = surface_offset(hit.p, hit.ng, 8 * dot(abs(hit.ng), size_));
  const Vec3 n = smooth_ ? to_normal(smooth_normal(p), hit.ng) : hit.ng;
  hit.uv = {0, 0};
  hit.frame = Frame(n);
  if (with_derivatives) hit.dp_du = hit.frame.s, hit.dp_dv = hit.frame.t;
}

std::shared_ptr<Shape> SdfGrid::transformed(const Transform& to_world) const {
  return std::make_shared<SdfGrid>(to_world * to_world_, grid_, smooth_, flipped_);
}

}  // namespace covary
