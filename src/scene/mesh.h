// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <vector>

#include "core/distribution.h"
#include "core/large_vector.h"
#include "scene/shape.h"

namespace covary {

/// A named mesh attribute, `vertex_…` or `face_…`: one or three numbers per vertex or triangle.
struct MeshAttribute {
  std::string name;
  bool per_face = false;
  int channels = 1;
  std::vector<float> values;
};

/// A vertex's direction of dp/du, which takes the place of that of its texture coordinates in shading frames.
struct MeshTangent {
  Vec3 along;      ///< any length; zero: none
  float side = 1;  ///< 1: dp/dv is towards normal x tangent; -1: away from it
  MeshTangent moved(const Transform& to) const { return {to.vector(along), to.flips_handedness() ? -side : side}; }
};

/// Vertex and index arrays of a triangle mesh in world space (or in the space of its shape group).
struct MeshData {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;          ///< unit, one per vertex, or empty: flat shading
  std::vector<Vec2> uvs;              ///< one per vertex, or empty
  std::vector<Spectrum> colours;      ///< one per vertex, or empty
  std::vector<MeshTangent> tangents;  ///< one per vertex, or empty
  std::vector<std::array<uint32_t, 3>> triangles;
  std::vector<MeshAttribute> attributes;  ///< other than vertex colours
  bool flip_normals = false;              ///< reverse geometric and shading normals
};

class TriangleMesh final : public Shape {
 public:
  /// Throws Error(kInput) if array lengths differ, an index is out of range or a position is not finite. Degenerate
  /// triangles (zero area) are dropped and counted.
  explicit TriangleMesh(MeshData data);

  Bounds3 bounds() const override { return bounds_; }
  void fill(const Ray& ray, SurfaceHit& hit, bool with_derivatives) const override;
  float area() const override { return static_cast<float>(areas_.sum()); }
  size_t n_primitives() const override { return triangles_.size(); }
  AreaSample sample_area(Vec2 u, float u_primitive) const override;
  // Parts: a parallelogram with (u, v) over the unit square is one part; other meshes have one per triangle.
  uint32_t n_parts() const override { return is_parallelogram() ? 1 : static_cast<uint32_t>(triangles_.size()); }
  uint32_t triangles_per_part() const override { return is_parallelogram() ? 2 : 1; }
  float part_area(uint32_t part) const override;
  AreaSample sample_part(uint32_t part, Vec2 u) const override;
  Bounds3 part_bounds(uint32_t part) const override;
  Vec3 part_normal(uint32_t part) const override;
  EmitterSample sample_towards(const Vec3& reference, Vec2 u, float u_primitive) const override;
  /// Only for two triangles forming a parallelogram whose (u, v) cover the unit square, such as `rectangle`.
  AreaSample sample_uv(Vec2 uv) const override;
  /// Null for other meshes.
  const Parallelogram* parallelogram() const { return is_parallelogram() ? &parallelogram_ : nullptr; }
  std::shared_ptr<Shape> transformed(const Transform& to_world) const override;
  Spectrum vertex_colour(const SurfaceHit& hit) const override;
  Spectrum attribute(std::string_view name, const SurfaceHit& hit) const override;
  bool has_attribute(std::string_view name) const override;
  bool has_attributes() const override { return !colours_.empty() || !attributes_.empty(); }
  bool has_vertex_colour() const override { return !colours_.empty(); }
  /// Prepares sample_area(), area() and everything about parts; called by the scene for emissive meshes. Not needed
  /// otherwise.
  void prepare_sampling();

  /// One record per vertex, so that a hit touches few cache lines and the ray tracer shares the array.
  struct Vertex {
    Vec3 p, n;
    Vec2 uv;
  };
  const LargeVector<Vertex>& vertices() const { return vertices_; }
  const std::vector<std::array<uint32_t, 3>>& triangles() const { return triangles_; }
  /// Surface parameters of a point on a triangle: its barycentric coordinates if the mesh has none.
  Vec2 uv_at(uint32_t triangle, Vec2 barycentric) const {
    if (!has_uvs_) return barycentric;
    const auto& t = triangles_[triangle];
    const float b1 = barycentric.x, b2 = barycentric.y, b0 = 1 - b1 - b2;
    return vertices_[t[0]].uv * b0 + vertices_[t[1]].uv * b1 + vertices_[t[2]].uv * b2;
  }
  size_t n_degenerate() const { return n_degenerate_; }

 private:
  LargeVector<Vertex> vertices_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  std::vector<Spectrum> colours_;
  std::vector<MeshTangent> tangents_;
  std::vector<MeshAttribute> attributes_;
  Bounds3 bounds_;
  bool has_normals_ = false, has_uvs_ = false;
  size_t n_degenerate_ = 0;

  /// Precomputed triangle data for sampling.
  struct Facet {
    Vec3 p, e1, e2, n;  // point = p + b1 e1 + b2 e2; n is AreaSample::n
    Vec2 uv, duv1, duv2;
    float slack;
    bool one_front;  // false: vertex normals on both sides, so that n is right on a part of the triangle alone
    Vec3 point(Vec2 b) const { return p + (e1 * b.x + e2 * b.y); }
    Vec2 uv_at(Vec2 b) const { return uv + duv1 * b.x + duv2 * b.y; }
  };
  std::vector<Facet> facets_;  // one per triangle after prepare_sampling()
  /// Whether all vertex normals of the triangle, with normal `n`, are on the front (1) or on the back (-1); else 0.
  int front_side(const std::array<uint32_t, 3>& triangle, const Vec3& n) const;
  AreaSample sample_facet(uint32_t triangle, Vec2 u) const;
  /// Turns the derivatives of a hit, whose frame has the normal `n`, to the vertices' tangents.
  void follow_tangents(const Vec3& n, SurfaceHit& hit) const;
  Discrete areas_;
  float inverse_area_ = 0;

  Parallelogram find_parallelogram() const;
  bool is_parallelogram() const { return parallelogram_.inverse_area > 0; }
  /// Sets triangle and barycentric coordinates of a point that was constructed from its (u, v).
  void find_triangle(AreaSample& at) const;
  Parallelogram parallelogram_;  // inverse_area == 0: not a parallelogram
};

}  // namespace covary
