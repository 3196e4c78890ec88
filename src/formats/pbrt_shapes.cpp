// SPDX-License-Identifier: Apache-2.0
// Shapes of pbrt-v4. Meshes embedded in the scene file become PLY files in memory: property `data` of `ply`.
#include <fmt/format.h>

#include <cmath>

#include "formats/object_builder.h"
#include "formats/pbrt_objects.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

ObjectBuilder shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement,
                    const Transform& own = Transform()) {
  auto result = make_object("shape", type, p.where(), {{"to_world", placement.to_world * own}});
  if (placement.reverse_orientation) set_property(*result, "flip_normals", true);
  return result;
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

ObjectBuilder mesh_shape(PbrtParameters& p, const PbrtPlacement& placement, EmbeddedMesh mesh, bool smooth) {
  ObjectBuilder result = shape("ply", p, placement);
  set_property(*result, std::string(kEmbeddedData), ply_text(mesh));
  if (!smooth) set_property(*result, "face_normals", true);
  return result;
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

ObjectBuilder triangle_mesh(PbrtParameters& p, const PbrtPlacement& placement) {
  std::optional<EmbeddedMesh> mesh = read_vertices(p);
  p.ignore({"S", "faceIndices"});
  if (!mesh) return nullptr;
  mesh->corners = read_indices(p, mesh->positions.size() / 3, 3);
  if (mesh->corners.empty()) return nullptr;
  const bool smooth = !mesh->normals.empty();
  return mesh_shape(p, placement, std::move(*mesh), smooth);
}

/// Patches that are parallelograms: two triangles each, with (u, v) covering the unit square.
ObjectBuilder bilinear_mesh(PbrtParameters& p, const PbrtPlacement& placement) {
  const std::optional<EmbeddedMesh> given = read_vertices(p);
  p.ignore({"faceIndices"});
  if (!given) return nullptr;
  if (p.has("emissionfilename")) p.error("has an 'emissionfilename', which is not supported");
  const std::vector<double> indices = read_indices(p, given->positions.size() / 3, 4);
  if (indices.empty()) return nullptr;
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
      return nullptr;
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
  const bool smooth = !mesh.normals.empty();
  return mesh_shape(p, placement, std::move(mesh), smooth);
}

/// Partial quadrics are not supported: the parameter must have the value of the whole.
void expect_whole(PbrtParameters& p, const char* name, double whole) {
  const double value = p.get_float(name, whole);
  if (std::abs(value - whole) > 1e-4 * std::max(std::abs(whole), 1.0))
    p.error(fmt::format("has {} {}; supported: whole ones, {}", name, value, whole));
}

ObjectBuilder sphere(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1);
  expect_whole(p, "zmin", -radius), expect_whole(p, "zmax", radius), expect_whole(p, "phimax", 360);
  ObjectBuilder result = shape("sphere", p, placement);
  set_property(*result, "radius", radius);
  return result;
}

ObjectBuilder disk(PbrtParameters& p, const PbrtPlacement& placement) {
  const auto radius = static_cast<float>(p.get_float("radius", 1)),
             height = static_cast<float>(p.get_float("height", 0));
  expect_whole(p, "innerradius", 0), expect_whole(p, "phimax", 360);
  if (!(radius > 0)) {
    p.error(fmt::format("has radius {}; it must be positive", radius));
    return nullptr;
  }
  return shape("disk", p, placement, Transform::translate({0, 0, height}) * Transform::scale({radius, radius, 1}));
}

ObjectBuilder cylinder(PbrtParameters& p, const PbrtPlacement& placement) {
  const double radius = p.get_float("radius", 1), low = p.get_float("zmin", -1), high = p.get_float("zmax", 1);
  expect_whole(p, "phimax", 360);
  ObjectBuilder result = shape("cylinder", p, placement);
  set_property(*result, "radius", radius);
  set_property(*result, "p0", Vec3{0, 0, static_cast<float>(std::min(low, high))});
  set_property(*result, "p1", Vec3{0, 0, static_cast<float>(std::max(low, high))});
  return result;
}

}  // namespace

ObjectBuilder make_pbrt_shape(const std::string& type, PbrtParameters& p, const PbrtPlacement& placement) {
  if (type == "sphere") return sphere(p, placement);
  if (type == "disk") return disk(p, placement);
  if (type == "cylinder") return cylinder(p, placement);
  if (type == "trianglemesh") return triangle_mesh(p, placement);
  if (type == "bilinearmesh") return bilinear_mesh(p, placement);
  if (type == "curve") return make_pbrt_curve(p, placement);
  if (type == "plymesh") {
    if (p.has("displacement")) p.error("has a 'displacement', which is not supported");
    p.ignore({"displacement", "edgelength"});
    ObjectBuilder result = shape("ply", p, placement);
    set_property(*result, "filename", p.get_string("filename", ""));
    return result;
  }
  p.error(
      "is not supported; supported: shapes 'bilinearmesh', 'curve', 'cylinder', 'disk', 'plymesh', 'sphere' and "
      "'trianglemesh'");
  return nullptr;
}

}  // namespace covary
