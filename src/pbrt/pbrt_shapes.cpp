// SPDX-License-Identifier: Apache-2.0
// Shapes of pbrt-v4. Meshes embedded in the scene file become PLY files in memory: property `data` of `ply`.
#include <fmt/format.h>

#include <cmath>

#include "formats/object_builder.h"
#include "pbrt/pbrt_objects.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

ObjectBuilder shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement, bool flip,
                    const Transform& own = Transform()) {
  auto result = make_object("shape", type, p.where(), {{"to_world", placement.to_world * own}});
  if (flip) set_property(*result, "flip_normals", true);
  return result;
}

/// Of a mesh without texture coordinates.
PbrtUv triangle_uv(const PbrtPlacement& placement) {
  const bool mirrored = placement.to_world.flips_handedness();
  if (placement.reverse_orientation) return mirrored ? PbrtUv::kMirroredFlippedTriangles : PbrtUv::kFlippedTriangles;
  return mirrored ? PbrtUv::kMirroredTriangles : PbrtUv::kTriangles;
}

}  // namespace

std::vector<double> read_pbrt_indices(PbrtParameters& p, size_t n_vertices, size_t width) {
  std::vector<double> indices = p.get_array("indices", "integer", width);
  if (indices.empty() && !p.has("indices") && n_vertices == width)
    for (size_t i = 0; i < width; ++i) indices.push_back(static_cast<double>(i));
  for (const double index : indices)
    if (!(index >= 0 && index < static_cast<double>(n_vertices) && index == std::floor(index))) {
      p.error(fmt::format("has the index {}; there are {} vertices", index, n_vertices));
      return {};
    }
  if (indices.empty()) p.error("has no indices");
  return indices;
}

PbrtShape pbrt_mesh_shape(PbrtParameters& p, const PbrtPlacement& placement, const EmbeddedMesh& mesh) {
  ObjectBuilder result = shape("ply", p, placement, placement.reverse_orientation);
  set_property(*result, std::string(kEmbeddedData), ply_text(mesh));
  if (mesh.normals.empty()) set_property(*result, "face_normals", true);
  return {result, mesh.uvs.empty() ? triangle_uv(placement) : PbrtUv::kOwn};
}

std::optional<EmbeddedMesh> read_pbrt_vertices(PbrtParameters& p) {
  EmbeddedMesh mesh;
  mesh.positions = p.get_array("P", "point3", 3);
  mesh.normals = p.get_array("N", "normal3", 3);
  p.rename("st", "uv");  // version 3
  mesh.uvs = p.get_array("uv", "point2", 2);
  const size_t n = mesh.positions.size() / 3;
  if (n == 0) {
    const PbrtParameter* given = p.find("P");
    if (given && given->numbers.empty() && given->strings.empty())
      p.warn("has no vertices; it is left out, as in pbrt");
    else
      p.error("has no vertices 'P'");
    return std::nullopt;
  }
  if ((!mesh.normals.empty() && mesh.normals.size() != 3 * n) || (!mesh.uvs.empty() && mesh.uvs.size() != 2 * n)) {
    p.error(fmt::format("has {} vertices, {} normals and {} texture coordinates", n, mesh.normals.size() / 3,
                        mesh.uvs.size() / 2));
    return std::nullopt;
  }
  return mesh;
}

namespace {

PbrtShape triangle_mesh(PbrtParameters& p, const PbrtPlacement& placement) {
  std::optional<EmbeddedMesh> mesh = read_pbrt_vertices(p);
  p.ignore({"S", "faceIndices"});
  if (!mesh) return {};
  mesh->corners = read_pbrt_indices(p, mesh->positions.size() / 3, 3);
  if (mesh->corners.empty()) return {};
  return pbrt_mesh_shape(p, placement, *mesh);
}

/// What the header of a PLY file says; unreadable files are reported when they are loaded.
struct PlyHeader {
  bool normals = false, uvs = false;
};
PlyHeader ply_header(const std::string& path) {
  constexpr size_t kLongest = 1 << 16;
  PlyHeader header;
  try {
    const FileView file(path);
    std::string_view text = file.text().substr(0, kLongest);
    text = text.substr(0, text.find("end_header"));
    while (!text.empty()) {
      const std::string_view line = text.substr(0, text.find_first_of("\r\n"));
      text.remove_prefix(std::min(line.size() + 1, text.size()));
      if (!line.starts_with("property ")) continue;
      const std::string_view name = line.substr(line.find_last_of(' ') + 1);
      header.normals |= name == "nx";
      header.uvs |= name == "u" || name == "s" || name == "texture_u" || name == "texture_s";
    }
  } catch (const Error&) {
  }
  return header;
}

PbrtShape ply_mesh(PbrtParameters& p, const PbrtPlacement& placement, FileResolver& files) {
  if (p.has("displacement")) p.warn("is displaced in pbrt; here its triangles stay where they are");
  p.ignore({"displacement", "edgelength"});
  const std::string name = p.get_string("filename", "");
  ObjectBuilder result = shape("ply", p, placement, placement.reverse_orientation);
  set_property(*result, "filename", name);
  Diagnostics missing;  // reported when the file is loaded
  const PlyHeader header = ply_header(files.resolve(name, p.where(), missing));
  if (!header.normals) set_property(*result, "face_normals", true);
  return {result, header.uvs ? PbrtUv::kOwn : triangle_uv(placement)};
}

}  // namespace

PbrtShape make_pbrt_shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement,
                          FileResolver& files) {
  for (const char* quadric : {"sphere", "disk", "cylinder", "cone", "paraboloid", "hyperboloid"})
    if (type == quadric) return make_pbrt_quadric(type, p, placement);
  if (type == "trianglemesh") return triangle_mesh(p, placement);
  if (type == "bilinearmesh") return make_pbrt_bilinear_mesh(p, placement);
  if (type == "loopsubdiv") return make_pbrt_subdivision(p, placement);
  if (type == "heightfield") return make_pbrt_height_field(p, placement);
  if (type == "nurbs") return make_pbrt_nurbs(p, placement);
  if (type == "curve") return make_pbrt_curve(p, placement);
  if (type == "plymesh") return ply_mesh(p, placement, files);
  p.unknown(
      "shapes 'bilinearmesh', 'curve', 'cylinder', 'disk', 'loopsubdiv', 'plymesh', 'sphere' and 'trianglemesh', and "
      "'cone', 'heightfield', 'hyperboloid', 'nurbs' and 'paraboloid' of version 3",
      "it is left out");
  return {};
}

}  // namespace covary
