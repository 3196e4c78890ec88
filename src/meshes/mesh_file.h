// SPDX-License-Identifier: Apache-2.0
// Triangle meshes from files. The readers are pure functions of the file's bytes; anything wrong throws Error(kInput)
// and says where in the file. Nothing is allocated on the word of a header alone: counts are checked against the file's
// size.
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

/// A mesh in the space of its file.
struct MeshFile {
  MeshData mesh;  ///< normals as in the file (any length; zero where a vertex has none), or empty
  /// For formats that index positions apart from other attributes: the position each vertex came from. Vertices of one
  /// position share computed normals. Empty: every vertex is a position of its own.
  std::vector<uint32_t> points;
};

/// Stanford PLY: ascii, binary little and big endian. Polygons become fans around their first vertex. Reads x y z, nx
/// ny nz, texture coordinates ("u v", "s t", "texture_u texture_v") and colours ("r g b", "red green blue", "color_r
/// …"; integers are divided by their largest value), and of the `attributes` asked for those it has; skips everything
/// else. An attribute "vertex_NAME" or "face_NAME" is a property "NAME" or "NAME_0" (or "NAME_1", "NAME_x", "NAME_r"),
/// or three, "NAME_0 NAME_1 NAME_2", "NAME_1 …", "NAME_x …", "NAME_r …"; "color" also "r g b", "red green blue".
MeshFile read_ply(std::span<const std::byte> bytes, std::span<const std::string> attributes = {});

/// Wavefront OBJ: v, vt, vn, f (negative indices count from the end); other statements are skipped. All groups and
/// objects of the file become one mesh.
MeshFile read_obj(std::string_view text);

/// Mitsuba 0.x ".serialized", format versions 3 and 4: mesh number `shape_index` of the file.
MeshFile read_serialized(std::span<const std::byte> bytes, int shape_index);

/// Throws Error(kInput) when there are no triangles, a position is not finite or an index is out of range. The readers
/// call it last.
void check_mesh(const MeshFile& file);

struct MeshPlacement {
  Transform to_world;
  bool face_normals = false;  ///< flat shading: normals of the file are dropped and none are computed
  bool flip_normals = false;
  bool flip_tex_coords = false;  ///< v becomes 1 - v
};

/// Moves a mesh into the scene, Mitsuba's way: a mirroring transformation reverses the order of vertices, so that
/// geometric normals stay on the side of the given ones; without normals in the file smooth ones are computed, each
/// face weighted by its angle at the vertex (Thürmer & Wüthrich 1998). `n_repaired`: how many normals of the file had
/// no direction and were computed instead.
MeshData place_mesh(MeshFile file, const MeshPlacement& placement, size_t& n_repaired);

}  // namespace covary
