// SPDX-License-Identifier: Apache-2.0
// Shapes of pbrt-v4. Meshes embedded in the scene file become PLY files in memory: property `data` of `ply`.
#include <fmt/format.h>

#include <cmath>

#include "formats/object_builder.h"
#include "formats/pbrt_objects.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

ObjectBuilder shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement, bool flip,
                    const Transform& own = Transform()) {
  auto result = make_object("shape", type, p.where(), {{"to_world", placement.to_world * own}});
  if (flip) set_property(*result, "flip_normals", true);
  return result;
}

/// pbrt's normals of spheres, disks and cylinders point to the other side under a mirroring transformation (shapes.h:
/// flipNormal), those of meshes do not.
bool flips_quadric(const PbrtPlacement& placement) {
  return placement.reverse_orientation != placement.to_world.flips_handedness();
}

/// Indices in groups of `width`; empty after an error.
std::vector<double> read_indices(PbrtParameters& p, size_t n_vertices, size_t width) {
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

/// Of a mesh without texture coordinates.
PbrtUv triangle_uv(const PbrtPlacement& placement) {
  const bool mirrored = placement.to_world.flips_handedness();
  if (placement.reverse_orientation) return mirrored ? PbrtUv::kMirroredFlippedTriangles : PbrtUv::kFlippedTriangles;
  return mirrored ? PbrtUv::kMirroredTriangles : PbrtUv::kTriangles;
}

PbrtShape mesh_shape(PbrtParameters& p, const PbrtPlacement& placement, const EmbeddedMesh& mesh) {
  ObjectBuilder result = shape("ply", p, placement, placement.reverse_orientation);
  set_property(*result, std::string(kEmbeddedData), ply_text(mesh));
  if (mesh.normals.empty()) set_property(*result, "face_normals", true);
  return {result, mesh.uvs.empty() ? triangle_uv(placement) : PbrtUv::kOwn};
}

/// Positions and per-vertex attributes.
std::optional<EmbeddedMesh> read_vertices(PbrtParameters& p) {
  EmbeddedMesh mesh;
  mesh.positions = p.get_array("P", "point3", 3);
  mesh.normals = p.get_array("N", "normal3", 3);
  mesh.uvs = p.get_array("uv", "point2", 2);
  const size_t n = mesh.positions.size() / 3;
  if (n == 0) {
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

PbrtShape triangle_mesh(PbrtParameters& p, const PbrtPlacement& placement) {
  std::optional<EmbeddedMesh> mesh = read_vertices(p);
  p.ignore({"S", "faceIndices"});
  if (!mesh) return {};
  mesh->corners = read_indices(p, mesh->positions.size() / 3, 3);
  if (mesh->corners.empty()) return {};
  return mesh_shape(p, placement, *mesh);
}

/// Patches that are parallelograms: two triangles each, with (u, v) covering the unit square.
PbrtShape bilinear_mesh(PbrtParameters& p, const PbrtPlacement& placement) {
  const std::optional<EmbeddedMesh> given = read_vertices(p);
  p.ignore({"faceIndices"});
  if (!given) return {};
  if (p.has("emissionfilename")) p.error("has an 'emissionfilename', which is not supported");
  const std::vector<double> indices = read_indices(p, given->positions.size() / 3, 4);
  if (indices.empty()) return {};
  EmbeddedMesh mesh;
  for (size_t patch = 0; patch < indices.size(); patch += 4) {
    const auto first = static_cast<double>(mesh.positions.size() / 3);
    double off = 0, size = 0;
    for (size_t k = 0; k < 3; ++k) {
      double v[4];
      for (size_t i = 0; i < 4; ++i) v[i] = given->positions[static_cast<size_t>(indices[patch + i]) * 3 + k];
      off = std::max(off, std::abs(v[0] + v[3] - v[1] - v[2]));
      size = std::max({size, std::abs(v[1] - v[0]), std::abs(v[2] - v[0])});
    }
    if (off > 1e-4 * size) {
      p.error(fmt::format("is not a parallelogram in patch {}; only parallelograms are supported", patch / 4));
      return {};
    }
    for (size_t i = 0; i < 4; ++i) {
      const auto vertex = static_cast<size_t>(indices[patch + i]);
      for (size_t k = 0; k < 3; ++k) mesh.positions.push_back(given->positions[vertex * 3 + k]);
      for (size_t k = 0; k < 3 && !given->normals.empty(); ++k) mesh.normals.push_back(given->normals[vertex * 3 + k]);
      if (given->uvs.empty()) {
        mesh.uvs.push_back(static_cast<double>(i % 2)), mesh.uvs.push_back(static_cast<double>(i / 2));
      } else {
        mesh.uvs.push_back(given->uvs[vertex * 2]), mesh.uvs.push_back(given->uvs[vertex * 2 + 1]);
      }
    }
    for (const int corner : {1, 2, 0, 1, 3, 2}) mesh.corners.push_back(first + corner);
  }
  return mesh_shape(p, placement, mesh);
}

/// Partial quadrics are not supported: the parameter must have the value of the whole.
void expect_whole(PbrtParameters& p, const char* name, double whole) {
  const double value = p.get_float(name, whole);
  if (std::abs(value - whole) > 1e-4 * std::max(std::abs(whole), 1.0))
    p.error(fmt::format("has {} {}; supported: whole ones, {}", name, value, whole));
}

/// Never mirrored: Mitsuba's normals depend on that, ours do not. Half turned and mirrored, it has pbrt's coordinates.
PbrtShape sphere(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1);
  expect_whole(p, "zmin", -radius), expect_whole(p, "zmax", radius), expect_whole(p, "phimax", 360);
  const bool mirrored = placement.to_world.flips_handedness();
  ObjectBuilder result =
      shape("sphere", p, placement, flips_quadric(placement), mirrored ? Transform::scale({1, 1, -1}) : Transform());
  set_property(*result, "radius", radius);
  return {result, mirrored ? PbrtUv::kOwn : PbrtUv::kSphere};
}

PbrtShape disk(PbrtParameters& p, const PbrtPlacement& placement) {
  const auto radius = static_cast<float>(p.get_float("radius", 1)),
             height = static_cast<float>(p.get_float("height", 0));
  expect_whole(p, "innerradius", 0), expect_whole(p, "phimax", 360);
  if (!(radius > 0)) {
    p.error(fmt::format("has radius {}; it must be positive", radius));
    return {};
  }
  return {shape("disk", p, placement, flips_quadric(placement),
                Transform::translate({0, 0, height}) * Transform::scale({radius, radius, 1})),
          PbrtUv::kDisk};
}

ObjectBuilder cylinder(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1), low = p.get_float("zmin", -1), high = p.get_float("zmax", 1);
  expect_whole(p, "phimax", 360);
  ObjectBuilder result = shape("cylinder", p, placement, flips_quadric(placement));
  set_property(*result, "radius", radius);
  set_property(*result, "p0", Vec3{0, 0, static_cast<float>(std::min(low, high))});
  set_property(*result, "p1", Vec3{0, 0, static_cast<float>(std::max(low, high))});
  return result;
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
  if (p.has("displacement")) p.error("has a 'displacement', which is not supported");
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
  if (type == "sphere") return sphere(p, placement);
  if (type == "disk") return disk(p, placement);
  if (type == "cylinder") return {cylinder(p, placement)};
  if (type == "trianglemesh") return triangle_mesh(p, placement);
  if (type == "bilinearmesh") return bilinear_mesh(p, placement);
  if (type == "curve") return {make_pbrt_curve(p, placement), PbrtUv::kCurve};
  if (type == "plymesh") return ply_mesh(p, placement, files);
  p.error(
      "is not supported; supported: shapes 'bilinearmesh', 'curve', 'cylinder', 'disk', 'plymesh', 'sphere' and "
      "'trianglemesh'");
  return {};
}

}  // namespace covary
