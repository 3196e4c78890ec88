// SPDX-License-Identifier: Apache-2.0
#include "meshes/mesh_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/error.h"
#include "core/parallel.h"

namespace covary {
namespace {

/// Number of triangles whose normals are computed in parallel before they are summed sequentially, in order.
constexpr size_t kBlock = size_t{1} << 16;

/// The triangle's normal weighted by the angle at each corner; zero if its area is zero.
std::array<Vec3, 3> normals_by_angle(const MeshData& mesh, const std::array<uint32_t, 3>& t) {
  const Vec3 p[3] = {mesh.positions[t[0]], mesh.positions[t[1]], mesh.positions[t[2]]};
  const Vec3 normal = cross(p[1] - p[0], p[2] - p[0]);
  const float length_of_normal = length(normal);
  std::array<Vec3, 3> parts{};
  if (!(length_of_normal > 0)) return parts;
  for (int k = 0; k < 3; ++k) {
    const Vec3 a = p[(k + 1) % 3] - p[k], b = p[(k + 2) % 3] - p[k];
    const float angle = std::atan2(length(cross(a, b)), dot(a, b));
    parts[k] = normal * (angle / length_of_normal);
  }
  return parts;
}

/// Angle-weighted normal per point; zero if no triangle of positive area meets the point.
std::vector<Vec3> smooth_normals(const MeshData& mesh, const std::vector<uint32_t>& points) {
  const auto point_of = [&](uint32_t vertex) { return points.empty() ? vertex : points[vertex]; };
  const size_t n_points =
      points.empty() ? mesh.positions.size() : size_t{1} + *std::max_element(points.begin(), points.end());
  std::vector<Vec3> sums(n_points);
  std::vector<std::array<Vec3, 3>> parts(std::min(kBlock, mesh.triangles.size()));
  for (size_t first = 0; first < mesh.triangles.size(); first += kBlock) {
    const size_t n = std::min(kBlock, mesh.triangles.size() - first);
    parallel_for(n, 1024, [&](size_t i) { parts[i] = normals_by_angle(mesh, mesh.triangles[first + i]); });
    for (size_t i = 0; i < n; ++i)
      for (int k = 0; k < 3; ++k) sums[point_of(mesh.triangles[first + i][k])] += parts[i][k];
  }
  for (Vec3& n : sums) {
    const float l = length(n);
    n = l > 0 ? n * (1 / l) : Vec3{};
  }
  return sums;
}

}  // namespace

void check_mesh(const MeshFile& file) {
  const MeshData& mesh = file.mesh;
  const size_t n = mesh.positions.size();
  if (mesh.triangles.empty()) throw Error(ErrorCode::kInput, "the mesh has no triangles");
  for (size_t i = 0; i < n; ++i)
    if (!is_finite(mesh.positions[i])) {
      const Vec3& p = mesh.positions[i];
      throw Error(ErrorCode::kInput, fmt::format("vertex {} has the position ({}, {}, {})", i, p.x, p.y, p.z));
    }
  for (size_t i = 0; i < mesh.triangles.size(); ++i)
    for (uint32_t index : mesh.triangles[i])
      if (index >= n)
        throw Error(ErrorCode::kInput, fmt::format("triangle {} uses vertex {}, but there are only {}", i, index, n));
}

MeshData place_mesh(MeshFile file, const MeshPlacement& placement, size_t& n_repaired) {
  MeshData mesh = std::move(file.mesh);
  const Transform& to_world = placement.to_world;
  const bool moved = !to_world.is_identity();
  n_repaired = 0;
  if (moved)
    for (Vec3& p : mesh.positions) p = to_world.point(p);
  if (moved && to_world.flips_handedness())
    for (auto& t : mesh.triangles) std::swap(t[0], t[2]);
  if (placement.flip_tex_coords)
    for (Vec2& uv : mesh.uvs) uv.y = 1 - uv.y;
  for (Vec2& uv : mesh.uvs)
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = {};
  for (MeshTangent& t : mesh.tangents) {
    if (moved) t = t.moved(to_world);
    if (!is_finite(t.along)) t.along = {};
  }
  for (Spectrum& c : mesh.colours)
    if (!is_finite(c)) c = Spectrum(0);
  mesh.flip_normals = placement.flip_normals;

  if (placement.face_normals) {
    mesh.normals.clear();
    return mesh;
  }
  std::vector<uint32_t> to_repair;
  if (mesh.normals.empty()) {
    mesh.normals = smooth_normals(mesh, file.points);
    if (!file.points.empty()) {
      std::vector<Vec3> spread(mesh.positions.size());
      for (size_t i = 0; i < spread.size(); ++i) spread[i] = mesh.normals[file.points[i]];
      mesh.normals = std::move(spread);
    }
    return mesh;
  }
  for (size_t i = 0; i < mesh.normals.size(); ++i) {
    Vec3& n = mesh.normals[i];
    if (moved) n = to_world.normal(n);
    const float inverse_length = 1 / length(n);
    if (std::isfinite(inverse_length) && inverse_length > 0) {
      n *= inverse_length;
    } else {
      to_repair.push_back(static_cast<uint32_t>(i));
    }
  }
  if (!to_repair.empty()) {
    const std::vector<Vec3> smooth = smooth_normals(mesh, file.points);
    for (uint32_t i : to_repair) mesh.normals[i] = smooth[file.points.empty() ? i : file.points[i]];
    n_repaired = to_repair.size();
  }
  return mesh;
}

}  // namespace covary
