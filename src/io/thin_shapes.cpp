// SPDX-License-Identifier: Apache-2.0
#include "io/thin_shapes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <set>

#include "scene/curve.h"
#include "scene/mesh.h"

namespace covary {
namespace {

constexpr float kFarInDiameters = 32;
constexpr size_t kMaxShapes = 4096, kMaxNamed = 3;
constexpr uint32_t kPoints = 6;  // probed per shape

struct SurfacePoint {
  Vec3 p, n;
};

/// The spacing of floats at the point's largest coordinate.
float spacing_at(const Vec3& p) {
  const float largest = max_component(abs(p));
  return std::nextafter(largest, kInfinity) - largest;
}

/// Point `i` of kPoints on a shape in its own space; none if it is a curve or a signed-distance grid, which have no
/// thin parts that rays leave and meet again.
std::optional<SurfacePoint> point_on(const Shape& shape, uint32_t i) {
  if (const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape)) {
    const size_t n = mesh->triangles().size();
    if (n == 0) return {};
    const auto& t = mesh->triangles()[n * i / kPoints];
    const Vec3 a = mesh->vertices()[t[0]].p, e1 = mesh->vertices()[t[1]].p - a, e2 = mesh->vertices()[t[2]].p - a;
    return SurfacePoint{a + (e1 + e2) * (1.0f / 3), normalize(cross(e1, e2))};
  }
  if (!shape.can_emit()) return {};  // sample_area() is for lights
  const float u = (static_cast<float>(i) + 0.5f) / kPoints;
  const AreaSample at = shape.sample_area({u, std::fmod(u * 3.7f, 1.0f)}, u);
  return SurfacePoint{at.p, at.n};
}

/// Distance from a point on `shape` to its nearest surface along `w`, the normal or its opposite; infinity if that is
/// at least `most` or belongs to another shape.
float thickness(const Scene& scene, const Shape& shape, const SurfacePoint& at, const Vec3& w, float most) {
  const float step = spacing_at(at.p);
  if (!std::isfinite(dot(at.p, at.p)) || !(dot(w, w) > 0)) return kInfinity;  // without a normal, or too far away
  Ray ray{at.p - w * (4 * step), w, most + 8 * step};
  SurfaceHit hit;
  float first = kInfinity;
  for (int i = 0; i < 2 + static_cast<int>(kMinSpacings) && scene.intersect(ray, hit); ++i) {
    const float along = dot(hit.p - at.p, w);
    if (first == kInfinity)
      first = along;
    else if (along > first + step)
      return hit.shape == &shape ? along - first : kInfinity;
    ray.o = hit.p + w * step;
    ray.t_max = most - along;
    if (!(ray.t_max > 0)) break;
  }
  return kInfinity;
}

class Search {
 public:
  Search(const Scene& scene, const std::function<std::string(const Shape&)>& name_of,
         std::vector<std::string>& warnings)
      : scene_(scene), name_of_(name_of), warnings_(warnings) {}

  void probe(const Shape& shape, const Transform& to_world) {
    const Bounds3 bounds = to_world.bounds(shape.bounds());
    if (!(max_component(abs(bounds.center())) > kFarInDiameters * bounds.radius()) || named_.contains(&shape)) return;
    for (uint32_t i = 0; i < kPoints; ++i) {
      const std::optional<SurfacePoint> local = point_on(shape, i);
      if (!local) return;
      const SurfacePoint at{to_world.point(local->p), normalize(to_world.normal(local->n))};
      const float spacing = spacing_at(at.p), most = kMinSpacings * spacing;
      const float found = std::min(thickness(scene_, shape, at, at.n, most), thickness(scene_, shape, at, -at.n, most));
      if (found < most) return warn(shape, fmt::format("{:.2g} thick", found), at.p, "light that passes it", most);
    }
    const float most = kMinAcross * spacing_at(bounds.center()), across = 2 * bounds.radius();
    if ((shape.bsdf_flags() & kTransmission) && across < most)
      warn(shape, fmt::format("{:.2g} across", across), bounds.center(),
           "light that passes it where it meets other surfaces", most);
  }

  void warn(const Shape& shape, const std::string& size, const Vec3& p, const char* what, float least) {
    named_.insert(&shape);
    if (named_.size() <= kMaxNamed)
      warnings_.push_back(
          fmt::format("{} is {} at ({:.7g}, {:.7g}, {:.7g}), where floats are {:.2g} apart: {} may be "
                      "wrong; expected at least {:.2g}, or a place nearer to the origin",
                      name_of_(shape), size, p.x, p.y, p.z, spacing_at(p), what, least));
  }

  void finish() {
    if (named_.size() > kMaxNamed)
      warnings_.push_back(fmt::format("{} more shapes are as thin for where they stand", named_.size() - kMaxNamed));
  }

 private:
  const Scene& scene_;
  const std::function<std::string(const Shape&)>& name_of_;
  std::set<const Shape*> named_;
  std::vector<std::string>& warnings_;
};

}  // namespace

void warn_of_thin_shapes(const Scene& scene, const std::function<std::string(const Shape&)>& name_of,
                         std::vector<std::string>& warnings) {
  Search search(scene, name_of, warnings);
  size_t n = 0;
  for (const ShapePtr& shape : scene.shapes())
    if (n++ < kMaxShapes) search.probe(*shape, Transform());
  std::set<const ShapeGroup*> groups;
  for (const Instance& instance : scene.instances())
    for (const ShapePtr& shape : instance.group->shapes) {
      if (n++ < kMaxShapes) search.probe(*shape, instance.to_world);
      const auto* curve = dynamic_cast<const CurveShape*>(shape.get());
      if (curve && curve->kind() == CurveKind::kLinear && curve->shortest_segment() < kShortSegment / 8 &&
          groups.insert(instance.group.get()).second)
        warnings.push_back(
            fmt::format("{} has segments of length {:.2g} in a shapegroup, which the ray tracer may see too thick; "
                        "expected at least {:.2g}: enlarge them, and scale the instances down",
                        name_of(*shape), curve->shortest_segment(), kShortSegment / 8));
    }
  search.finish();
}

}  // namespace covary
