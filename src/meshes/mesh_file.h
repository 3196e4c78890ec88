// SPDX-License-Identifier: Apache-2.0
// Triangle meshes from files. The readers are pure functions of the file's bytes; they throw Error(kInput), which says
// where in the file the error is. Counts in headers are checked against the file's size before anything is allocated.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/transform.h"
#include "scene/mesh.h"

namespace covary {

/// A mesh in object space.
struct MeshFile {
  MeshData mesh;  ///< normals as in the file (any length; zero if a vertex has none), or empty
  /// For formats that index positions separately from other attributes: the position each vertex came from. Vertices
  /// with the same position share computed normals. Empty: each vertex has its own position.
  std::vector<uint32_t> points;
};

/// Stanford PLY: ascii, binary little and big endian. Polygons become triangles (polygon.h). Reads x y z, nx ny nz,
/// texture coordinates ("u v", "s t", "texture_u texture_v"), colours ("r g b", "red green blue", "color_r …"; integers
/// are divided by the maximum of their type), tangents ("tx ty tz tw") and those of the requested `attributes` that are
/// present; skips everything else. An attribute "vertex_NAME" or "face_NAME" is a property "NAME" or "NAME_0" (or
/// "NAME_1", "NAME_x", "NAME_r"), or three, "NAME_0 NAME_1 NAME_2", "NAME_1 …", "NAME_x …", "NAME_r …"; "color" also "r
/// g b", "red green blue".
MeshFile read_ply(std::span<const std::byte> bytes, std::span<const std::string> attributes = {});

/// Wavefront OBJ: v, vt, vn, f (polygons as in PLY; negative indices count from the end); other statements are skipped.
/// All groups and objects in the file become one mesh.
MeshFile read_obj(std::string_view text);

/// Mitsuba 0.x ".serialized", format versions 3 and 4: reads mesh `shape_index` of the file.
MeshFile read_serialized(std::span<const std::byte> bytes, int shape_index);

/// Throws Error(kInput) if there are no triangles, a position is not finite or an index is out of range. Each reader
/// calls it last.
void check_mesh(const MeshFile& file);

struct MeshPlacement {
  Transform to_world;
  bool face_normals = false;  ///< flat shading: normals in the file are dropped and none are computed
  bool flip_normals = false;
  bool flip_tex_coords = false;  ///< v becomes 1 - v
};

/// Transforms a mesh to world space as Mitsuba does: a mirroring transformation reverses the order of vertices so that
/// geometric normals stay on the side of the shading normals; if the file has no normals, smooth ones are computed,
/// each face weighted by its angle at the vertex (Thürmer & Wüthrich 1998). `n_repaired`: number of normals in the file
/// that were zero or not finite and were computed instead.
MeshData place_mesh(MeshFile file, const MeshPlacement& placement, size_t& n_repaired);

}  // namespace covary
