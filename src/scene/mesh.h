// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <vector>

#include "core/distribution.h"
#include "scene/shape.h"

namespace covary {

/// Vertex and index arrays of a triangle mesh in world space (or in the space of its shape group).
struct MeshData {
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;       ///< unit, one per vertex, or empty: flat shading
  std::vector<Vec2> uvs;           ///< one per vertex, or empty
  std::vector<Spectrum> colours;   ///< one per vertex, or empty
  std::vector<std::array<uint32_t, 3>> triangles;
  bool flip_normals = false;       ///< reverse geometric and shading normals
};

class TriangleMesh final : public Shape {
 public:
  /// Throws Error(kInput) when arrays differ in length, an index is out of range or a position is not finite.
  /// Degenerate triangles (zero area) are dropped and counted.
  explicit TriangleMesh(MeshData data);

  Bounds3 bounds() const override;
  float area() const override;
  AreaSample sample_area(Vec2 u, float u_primitive) const override;
  Spectrum vertex_colour(const SurfaceHit& hit) const override;
  bool has_vertex_colour() const override { return !data_.colours.empty(); }

  const MeshData& data() const { return data_; }
  size_t n_degenerate() const { return n_degenerate_; }
  /// Fills in everything of `hit` but t, shape, bsdf, emitter, from primitive and barycentric.
  void fill(SurfaceHit& hit, bool with_derivatives) const;

 private:
  MeshData data_;
  size_t n_degenerate_ = 0;
  Discrete areas_;  // only made when the mesh emits
  void prepare_sampling();
};

}  // namespace covary
