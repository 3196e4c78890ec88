// SPDX-License-Identifier: Apache-2.0
#include "scene/mesh.h"

#include <algorithm>
#include <string>
#include <utility>

#include "core/error.h"
#include "core/in_place.h"
#include "core/warp.h"

namespace covary {
namespace {

void check_length(const char* what, size_t length, size_t n_vertices) {
  if (length != 0 && length != n_vertices)
    throw Error(ErrorCode::kInput,
                "a mesh has " + std::to_string(n_vertices) + " vertices but " + std::to_string(length) + " " + what);
}

}  // namespace

TriangleMesh::TriangleMesh(MeshData data)
    : triangles_(std::move(data.triangles)),
      colours_(std::move(data.colours)),
      tangents_(std::move(data.tangents)),
      attributes_(std::move(data.attributes)),
      has_normals_(!data.normals.empty()),
      has_uvs_(!data.uvs.empty()) {
  const size_t n = data.positions.size();
  check_length("normals", data.normals.size(), n);
  check_length("texture coordinates", data.uvs.size(), n);
  check_length("vertex colours", colours_.size(), n);
  check_length("tangents", tangents_.size(), n);

  for (const MeshAttribute& a : attributes_)
    if (a.values.size() != (a.per_face ? triangles_.size() : n) * static_cast<size_t>(a.channels))
      throw Error(ErrorCode::kInput, "attribute '" + a.name + "' of a mesh has " + std::to_string(a.values.size()) +
                                         " values, which does not fit the mesh");

  const float sign = data.flip_normals ? -1.0f : 1.0f;
  vertices_.resize(n);
  for (size_t i = 0; i < n; ++i) {
    if (!is_finite(data.positions[i]))
      throw Error(ErrorCode::kInput, "vertex " + std::to_string(i) + " of a mesh has a position that is not finite");
    vertices_[i] = {data.positions[i], has_normals_ ? data.normals[i] * sign : Vec3{}, has_uvs_ ? data.uvs[i] : Vec2{}};
    bounds_.extend(data.positions[i]);
  }

  // Degenerate triangles cannot be hit and have no normal: drop them.
  size_t kept = 0;
  for (size_t i = 0; i < triangles_.size(); ++i) {
    std::array<uint32_t, 3> t = triangles_[i];
    for (uint32_t index : t)
      if (index >= n)
        throw Error(ErrorCode::kInput, "triangle " + std::to_string(i) + " of a mesh uses vertex " +
                                           std::to_string(index) + ", but there are only " + std::to_string(n));
    if (data.flip_normals) std::swap(t[1], t[2]);
    const Vec3 p0 = vertices_[t[0]].p;
    const Vec3 normal = cross(vertices_[t[1]].p - p0, vertices_[t[2]].p - p0);
    if (!(length_squared(normal) > 0)) continue;
    for (MeshAttribute& a : attributes_)
      if (a.per_face) std::copy_n(&a.values[i * a.channels], a.channels, &a.values[kept * a.channels]);
    triangles_[kept++] = t;
  }
  n_degenerate_ = triangles_.size() - kept;
  triangles_.resize(kept);
  parallelogram_ = find_parallelogram();
}

int TriangleMesh::front_side(const std::array<uint32_t, 3>& triangle, const Vec3& n) const {
  if (!has_normals_) return 1;
  bool front = false, back = false;
  for (const uint32_t index : triangle) {
    const float cosine = dot(vertices_[index].n, n);
    front |= cosine > 0, back |= cosine < 0;
  }
  return front && back ? 0 : (back ? -1 : 1);
}

Parallelogram TriangleMesh::find_parallelogram() const {
  if (triangles_.size() != 2 || !has_uvs_) return {};
  // Each triangle must have three corners of the unit square in (u, v), and the missing corners must be opposite.
  Vec2 missing[2] = {{0.5f, 0.5f}, {0.5f, 0.5f}};
  for (int i = 0; i < 2; ++i)
    for (int corner = 0; corner < 4; ++corner) {
      const Vec2 uv = {static_cast<float>(corner & 1), static_cast<float>(corner >> 1)};
      int n_found = 0;
      for (const uint32_t index : triangles_[i]) n_found += vertices_[index].uv == uv;
      if (n_found > 1 || (n_found == 0 && missing[i].x != 0.5f)) return {};
      if (n_found == 0) missing[i] = uv;
    }
  if (!(missing[0] + missing[1] == Vec2{1, 1})) return {};

  const auto& t = triangles_[0];
  const Vertex &v0 = vertices_[t[0]], &v1 = vertices_[t[1]], &v2 = vertices_[t[2]];
  const Vec3 e1 = v1.p - v0.p, e2 = v2.p - v0.p;
  const Vec2 d1 = v1.uv - v0.uv, d2 = v2.uv - v0.uv;
  const float inverse = 1 / (d1.x * d2.y - d1.y * d2.x);
  Parallelogram result;
  result.dp_du = (e1 * d2.y - e2 * d1.y) * inverse;
  result.dp_dv = (e2 * d1.x - e1 * d2.x) * inverse;
  result.origin = v0.p - result.dp_du * v0.uv.x - result.dp_dv * v0.uv.y;
  result.n = normalize(cross(e1, e2));
  const float tolerance = 1e-5f * (length(result.dp_du) + length(result.dp_dv) + max_component(abs(v0.p)));
  for (const uint32_t index : triangles_[1]) {
    const Vertex& v = vertices_[index];
    if (!(length(result.origin + result.dp_du * v.uv.x + result.dp_dv * v.uv.y - v.p) <= tolerance)) return {};
  }
  const auto& s = triangles_[1];
  const Vec3 other = cross(vertices_[s[1]].p - vertices_[s[0]].p, vertices_[s[2]].p - vertices_[s[0]].p);
  if (!(dot(other, result.n) > 0)) return {};
  const int side = front_side(t, result.n);
  if (side == 0 || side != front_side(s, result.n)) return {};
  result.n = result.n * static_cast<float>(side);
  result.inverse_area = 1 / length(cross(result.dp_du, result.dp_dv));
  const Vec3 reach = abs(result.dp_du) + abs(result.dp_dv);
  result.slack = plane_slack(reach, result.dp_du, result.dp_dv, result.inverse_area);
  return result;
}

AreaSample TriangleMesh::sample_uv(Vec2 uv) const {
  const Parallelogram& q = parallelogram_;
  AreaSample at = {q.origin + (q.dp_du * uv.x + q.dp_dv * uv.y), q.n, uv, q.inverse_area, 0, {}, q.slack};
  if (TriangleMesh::has_attributes() && is_parallelogram()) find_triangle(at);
  return at;
}

void TriangleMesh::find_triangle(AreaSample& at) const {
  float deepest = -kInfinity;  // the smallest vertex weight: non-negative inside, up to rounding
  for (uint32_t i = 0; i < triangles_.size(); ++i) {
    const auto& t = triangles_[i];
    const Vec2 uv0 = vertices_[t[0]].uv, d1 = vertices_[t[1]].uv - uv0, d2 = vertices_[t[2]].uv - uv0, d = at.uv - uv0;
    const float inverse = 1 / (d1.x * d2.y - d1.y * d2.x);
    const Vec2 b = {(d.x * d2.y - d.y * d2.x) * inverse, (d1.x * d.y - d1.y * d.x) * inverse};
    const float smallest = std::min({b.x, b.y, 1 - b.x - b.y});
    if (smallest > deepest) deepest = smallest, at.primitive = i, at.barycentric = b;
  }
}

void TriangleMesh::prepare_sampling() {
  if (triangles_.empty()) throw Error(ErrorCode::kInput, "a mesh that emits light has no triangle of positive area");
  std::vector<float> areas;
  facets_.clear();
  for (const auto& t : triangles_) {
    const Vertex &v0 = vertices_[t[0]], &v1 = vertices_[t[1]], &v2 = vertices_[t[2]];
    const Vec3 e1 = v1.p - v0.p, e2 = v2.p - v0.p, normal = cross(e1, e2);
    const float inverse = 1 / length(normal);
    // Without texture coordinates, the surface parameters are the barycentric coordinates.
    const Vec3 n = normal * inverse;
    const int side = front_side(t, n);
    facets_.push_back({v0.p, e1, e2, side < 0 ? -n : n, v0.uv, has_uvs_ ? v1.uv - v0.uv : Vec2{1, 0},
                       has_uvs_ ? v2.uv - v0.uv : Vec2{0, 1}, plane_slack(abs(e1) + abs(e2), e1, e2, inverse),
                       side != 0});
    areas.push_back(0.5f * length(normal));
  }
  areas_ = Discrete(areas);
  inverse_area_ = static_cast<float>(1 / areas_.sum());
}

void TriangleMesh::fill(const Ray& /*ray*/, SurfaceHit& hit, bool with_derivatives) const {
  const auto& t = triangles_[hit.primitive];
  const Vertex &v0 = vertices_[t[0]], &v1 = vertices_[t[1]], &v2 = vertices_[t[2]];
  const float b1 = hit.barycentric.x, b2 = hit.barycentric.y, b0 = 1 - b1 - b2;
  const Vec3 e1 = v1.p - v0.p, e2 = v2.p - v0.p;
  const Vec3 normal = cross(e1, e2);
  const float inverse = 1 / length(normal), margin = edge_margin(v0.p, e1, e2, inverse);
  const Vec3 d1 = e1 * lerp(margin, b1, 1.0f / 3), d2 = e2 * lerp(margin, b2, 1.0f / 3);
  hit.p = v0.p + (d1 + d2);
  hit.ng = normal * inverse;
  hit.offset = surface_offset(hit.p, hit.ng, plane_slack(abs(d1) + abs(d2), e1, e2, inverse));
  Vec3 n = hit.ng;
  if (has_normals_) {
    const Vec3 interpolated = v0.n * b0 + v1.n * b1 + v2.n * b2;
    const float l2 = length_squared(interpolated);
    if (l2 > 0) n = interpolated * (1 / std::sqrt(l2));
  }
  hit.uv = uv_at(hit.primitive, hit.barycentric);
  if (!with_derivatives) {
    make_in_place(hit.frame, [&] { return Frame(n); });
    return;
  }
  hit.dp_du = e1, hit.dp_dv = e2;
  if (has_uvs_) {
    const Vec2 uv1 = v1.uv - v0.uv, uv2 = v2.uv - v0.uv;
    const float determinant = uv1.x * uv2.y - uv1.y * uv2.x;
    const float scale = determinant != 0 ? 1 / determinant : 0;
    hit.dp_du = (e1 * uv2.y - e2 * uv1.y) * scale;
    hit.dp_dv = (e2 * uv1.x - e1 * uv2.x) * scale;
  }
  if (!tangents_.empty()) follow_tangents(n, hit);
  make_in_place(hit.frame, [&] { return Frame::from_tangent(n, hit.dp_du); });
}

void TriangleMesh::follow_tangents(const Vec3& n, SurfaceHit& hit) const {
  const auto& t = triangles_[hit.primitive];
  const float b1 = hit.barycentric.x, b2 = hit.barycentric.y;
  Vec3 along = tangents_[t[0]].along * (1 - b1 - b2) + tangents_[t[1]].along * b1 + tangents_[t[2]].along * b2;
  along = along - n * dot(n, along);
  const float l = length(along);
  if (!(l > 0)) return;
  along *= 1 / l;
  const float du = length(hit.dp_du), dv = length(hit.dp_dv);
  hit.dp_du = along * (du > 0 ? du : 1);
  hit.dp_dv = cross(n, along) * ((dv > 0 ? dv : 1) * tangents_[t[0]].side);
}

AreaSample TriangleMesh::sample_area(Vec2 u, float u_primitive) const {
  // One map for the whole parallelogram is cheaper than choosing a triangle, and continuous.
  if (is_parallelogram()) return TriangleMesh::sample_uv(u);
  AreaSample at = sample_facet(areas_.sample(u_primitive).index, u);
  at.pdf_area = inverse_area_;
  return at;
}

AreaSample TriangleMesh::sample_facet(uint32_t triangle, Vec2 u) const {
  const Facet& facet = facets_[triangle];
  const Vec2 b = warp::square_to_triangle(u);
  AreaSample at = {facet.point(b), facet.n, facet.uv_at(b), 0, triangle, b, facet.slack};
  if (facet.one_front) return at;
  const auto& t = triangles_[triangle];
  if (dot(vertices_[t[0]].n * (1 - b.x - b.y) + vertices_[t[1]].n * b.x + vertices_[t[2]].n * b.y, at.n) < 0)
    at.n = -at.n;
  return at;
}

float TriangleMesh::part_area(uint32_t part) const {
  return is_parallelogram() ? area() : 0.5f * length(cross(facets_[part].e1, facets_[part].e2));
}

AreaSample TriangleMesh::sample_part(uint32_t part, Vec2 u) const {
  if (is_parallelogram()) return TriangleMesh::sample_uv(u);
  AreaSample at = sample_facet(part, u);
  at.pdf_area = 1 / part_area(part);
  return at;
}

Bounds3 TriangleMesh::part_bounds(uint32_t part) const {
  if (is_parallelogram()) return bounds_;
  Bounds3 bounds;
  for (const uint32_t index : triangles_[part]) bounds.extend(vertices_[index].p);
  return bounds;
}

Vec3 TriangleMesh::part_normal(uint32_t part) const {
  if (is_parallelogram()) return parallelogram_.n;
  return facets_[part].one_front ? facets_[part].n : Vec3{};
}

EmitterSample TriangleMesh::sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const {
  return towards(reference, TriangleMesh::sample_area(u, u_primitive));
}

std::shared_ptr<Shape> TriangleMesh::transformed(const Transform& to_world) const {
  MeshData data;
  data.triangles = triangles_;
  data.colours = colours_;
  for (const MeshTangent& tangent : tangents_) data.tangents.push_back(tangent.moved(to_world));
  data.attributes = attributes_;
  for (MeshAttribute& a : data.attributes)
    if (a.per_face) a.values.resize(triangles_.size() * static_cast<size_t>(a.channels));
  for (const Vertex& vertex : vertices_) {
    data.positions.push_back(to_world.point(vertex.p));
    if (has_normals_) data.normals.push_back(normalize(to_world.normal(vertex.n)));
    if (has_uvs_) data.uvs.push_back(vertex.uv);
  }
  if (to_world.flips_handedness())  // keeps the geometric normal on the same side
    for (auto& t : data.triangles) std::swap(t[1], t[2]);
  return std::make_shared<TriangleMesh>(std::move(data));
}

Spectrum TriangleMesh::vertex_colour(const SurfaceHit& hit) const {
  if (colours_.empty()) return Spectrum(1);
  const auto& t = triangles_[hit.primitive];
  const float b1 = hit.barycentric.x, b2 = hit.barycentric.y;
  return colours_[t[0]] * (1 - b1 - b2) + colours_[t[1]] * b1 + colours_[t[2]] * b2;
}

bool TriangleMesh::has_attribute(std::string_view name) const {
  if (name == "vertex_color" && !colours_.empty()) return true;
  return std::any_of(attributes_.begin(), attributes_.end(), [&](const MeshAttribute& a) { return a.name == name; });
}

Spectrum TriangleMesh::attribute(std::string_view name, const SurfaceHit& hit) const {
  if (name == "vertex_color" && !colours_.empty()) return TriangleMesh::vertex_colour(hit);
  const auto a = std::find_if(attributes_.begin(), attributes_.end(), [&](const auto& b) { return b.name == name; });
  if (a == attributes_.end()) return Spectrum(1);
  const auto at = [&](size_t i) {
    const float* v = &a->values[i * static_cast<size_t>(a->channels)];
    return a->channels == 1 ? Spectrum(v[0]) : Spectrum(v[0], v[1], v[2]);
  };
  if (a->per_face) return at(hit.primitive);
  const auto& t = triangles_[hit.primitive];
  const float b1 = hit.barycentric.x, b2 = hit.barycentric.y;
  return at(t[0]) * (1 - b1 - b2) + at(t[1]) * b1 + at(t[2]) * b2;
}

}  // namespace covary
