// SPDX-License-Identifier: Apache-2.0
#include "meshes/polygon.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

/// A corner in the plane, in double precision: differences of coordinates, read as floats, are exact or nearly so.
struct Point {
  double x = 0, y = 0;
  bool operator==(const Point&) const = default;
};

/// Twice the signed area of a triangle, positive if counter-clockwise.
double turn(const Point& a, const Point& b, const Point& c) {
  return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

/// Twice the vector area, by Newell's method.
std::array<double, 3> vector_area(std::span<const uint32_t> corners, std::span<const Vec3> positions) {
  std::array<double, 3> sum = {0, 0, 0};
  const Vec3 o = positions[corners[0]];
  const auto relative = [&](size_t i) {
    const Vec3 p = positions[corners[i]];
    return std::array<double, 3>{static_cast<double>(p.x) - o.x, static_cast<double>(p.y) - o.y,
                                 static_cast<double>(p.z) - o.z};
  };
  for (size_t i = 2; i < corners.size(); ++i) {
    const auto a = relative(i - 1), b = relative(i);
    for (size_t k = 0; k < 3; ++k) sum[k] += a[(k + 1) % 3] * b[(k + 2) % 3] - a[(k + 2) % 3] * b[(k + 1) % 3];
  }
  return sum;
}

/// The corners seen along an axis, counter-clockwise; empty if the polygon has no normal.
std::vector<Point> project(std::span<const uint32_t> corners, std::span<const Vec3> positions) {
  const std::array<double, 3> normal = vector_area(corners, positions);
  size_t axis = 0;
  for (size_t k = 1; k < 3; ++k)
    if (std::abs(normal[k]) > std::abs(normal[axis])) axis = k;
  std::vector<Point> points;
  if (!(std::abs(normal[axis]) > 0)) return points;
  for (const uint32_t corner : corners) {
    const Vec3 p = positions[corner];
    const double all[3] = {p.x, p.y, p.z};
    Point point{all[(axis + 1) % 3], all[(axis + 2) % 3]};
    if (normal[axis] < 0) std::swap(point.x, point.y);
    points.push_back(point);
  }
  return points;
}

/// Whether a triangle of the fan is turned over by more than the rounding of coordinates to floats.
bool fan_turns_over(std::span<const Point> points) {
  double extent = 0, largest = 0;
  for (const Point& p : points) {
    extent = std::max({extent, std::abs(p.x - points[0].x), std::abs(p.y - points[0].y)});
    largest = std::max({largest, std::abs(p.x), std::abs(p.y)});
  }
  const double tolerance = 0x1p-22 * extent * (extent + largest);
  for (size_t i = 2; i < points.size(); ++i)
    if (turn(points[0], points[i - 1], points[i]) < -tolerance) return true;
  return false;
}

class EarClipper {
 public:
  explicit EarClipper(std::span<const Point> points) : points_(points), next_(points.size()), previous_(points.size()) {
    const auto n = static_cast<uint32_t>(points.size());
    for (uint32_t i = 0; i < n; ++i) next_[i] = (i + 1) % n, previous_[i] = (i + n - 1) % n;
    for (uint32_t i = 0; i < n; ++i)
      if (turn_at(i) <= 0) blockers_.push_back(i);
  }

  /// Calls emit(i, j, k) for each triangle.
  template <typename Emit>
  void run(const Emit& emit) {
    uint32_t at = 0;
    for (size_t left = points_.size(); left > 2; --left) {
      const uint32_t ear = find_ear(at, left);
      emit(previous_[ear], ear, next_[ear]);
      clip(ear);
      const uint32_t before = previous_[ear], after = next_[ear];
      // Spikes first: they divide the polygon where it touches itself. Else not the next corner, which would lead to
      // fans of thin triangles.
      at = is_spike(before) ? before : (is_spike(after) ? after : next_[after]);
    }
  }

 private:
  double turn_at(uint32_t i) const { return turn(points_[previous_[i]], points_[i], points_[next_[i]]); }

  /// Whether two of the corners here are at the same place: a triangle without area, which can always be clipped.
  bool is_spike(uint32_t i) const {
    const Point &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
    return a == b || b == c || c == a;
  }

  /// Any corner is a last resort: of polygons that cross themselves, or whose corners are all on a line.
  uint32_t find_ear(uint32_t at, size_t left) const {
    for (const bool touching : {false, true})
      for (size_t i = 0; i < left; ++i, at = next_[at])
        if (is_spike(at) || (turn_at(at) > 0 && !is_blocked(at, touching))) return at;
    for (size_t i = 0; i < left; ++i, at = next_[at])
      if (turn_at(at) > 0) return at;
    return at;
  }

  /// Whether another corner that is not convex lies in the triangle of corner `i`, or unless `touching`, on its edges.
  bool is_blocked(uint32_t i, bool touching) const {
    const Point &a = points_[previous_[i]], &b = points_[i], &c = points_[next_[i]];
    const double low_x = std::min({a.x, b.x, c.x}), high_x = std::max({a.x, b.x, c.x});
    const double low_y = std::min({a.y, b.y, c.y}), high_y = std::max({a.y, b.y, c.y});
    return std::any_of(blockers_.begin(), blockers_.end(), [&](uint32_t j) {
      const Point& p = points_[j];
      if (p.x < low_x || p.x > high_x || p.y < low_y || p.y > high_y) return false;
      if (p == a || p == b || p == c) return false;  // corners that meet, such as those of a cut to a hole
      const double least = std::min({turn(a, b, p), turn(b, c, p), turn(c, a, p)});
      return touching ? least > 0 : least >= 0;
    });
  }

  void clip(uint32_t ear) {
    const uint32_t before = previous_[ear], after = next_[ear];
    next_[before] = after, previous_[after] = before;
    std::erase_if(blockers_, [&](uint32_t j) { return j == ear || ((j == before || j == after) && turn_at(j) > 0); });
  }

  std::span<const Point> points_;
  std::vector<uint32_t> next_, previous_;
  std::vector<uint32_t> blockers_;  // corners that are not convex
};

}  // namespace

void add_polygon(std::span<const uint32_t> corners, std::span<const Vec3> positions,
                 std::vector<std::array<uint32_t, 3>>& triangles) {
  const bool exist = std::ranges::all_of(corners, [&](uint32_t corner) { return corner < positions.size(); });
  const std::vector<Point> points = corners.size() > 3 && exist ? project(corners, positions) : std::vector<Point>();
  if (points.empty() || !fan_turns_over(points)) {
    for (size_t i = 2; i < corners.size(); ++i) triangles.push_back({corners[0], corners[i - 1], corners[i]});
    return;
  }
  if (points.size() > kMaxConcaveCorners)
    throw Error(ErrorCode::kInput, fmt::format("a concave polygon has {} corners; at most {} are supported",
                                               points.size(), kMaxConcaveCorners));
  EarClipper(points).run([&](uint32_t i, uint32_t j, uint32_t k) {
    triangles.push_back({corners[i], corners[j], corners[k]});
  });
}

}  // namespace covary
