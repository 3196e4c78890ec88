// SPDX-License-Identifier: Apache-2.0
// Shapes by the name scene files use.
//
// | parameter       | type      | default | meaning                                                              |
// |-----------------|-----------|---------|----------------------------------------------------------------------|
// | to_world        | transform | none    | from the shape's space into the scene                                |
// | flip_normals    | boolean   | false   | turn the surface inside out                                          |
// | face_normals    | boolean   | false   | meshes: flat shading                                                 |
// | filename        | string    |         | obj, ply, serialized, linearcurve, bsplinecurve                      |
// | flip_tex_coords | boolean   | see     | obj (true), ply (false): v becomes 1 - v                             |
// | shape_index     | integer   | 0       | serialized: which mesh of the file                                   |
// | center, radius  |           | 0, 1    | sphere                                                               |
// | p0, p1, radius  |           | 0, z, 1 | cylinder                                                             |
#include "io/shapes.h"

#include <fmt/format.h>

#include "core/memory_limit.h"
#include "formats/file_view.h"
#include "io/curve_file.h"
#include "io/mesh_attributes.h"
#include "media/volume_file.h"
#include "meshes/mesh_file.h"
#include "scene/analytic_shape.h"
#include "scene/embedded_data.h"
#include "scene/mesh.h"
#include "scene/sdf_grid.h"

namespace covary {
namespace {

constexpr float kHuge = std::numeric_limits<float>::max();

MeshPlacement placement_of(Parameters& p) {
  MeshPlacement placement;
  placement.to_world = p.get_transform("to_world");
  placement.face_normals = p.get_bool("face_normals", false);
  placement.flip_normals = p.get_bool("flip_normals", false);
  return placement;
}

std::shared_ptr<Shape> finish(Parameters& p, MeshFile file, const MeshPlacement& placement) {
  size_t n_repaired = 0;
  auto mesh = std::make_shared<TriangleMesh>(place_mesh(std::move(file), placement, n_repaired));
  if (n_repaired > 0) p.warn(fmt::format("{} normals of the file have no direction and were computed", n_repaired));
  return mesh;
}

template <typename Read>
std::shared_ptr<Shape> make_from_file(Parameters& p, const MeshPlacement& placement, Read&& read) {
  const std::string path = p.require_file("filename");
  if (path.empty()) return nullptr;
  try {
    const FileView view(path);
    // Arrays of the file's size, about, as they are read and as they are kept.
    require_memory(path, "its mesh", 3 * static_cast<double>(view.bytes().size()));
    return finish(p, read(view), placement);
  } catch (const Error& error) {
    p.error_at("filename", fmt::format("names '{}': {}", p.get_string("filename", ""), error.what()));
    return nullptr;
  }
}

std::shared_ptr<Shape> make_obj(Parameters& p) {
  MeshPlacement placement = placement_of(p);
  placement.flip_tex_coords = p.get_bool("flip_tex_coords", true);
  return make_from_file(p, placement, [](const FileView& view) { return read_obj(view.text()); });
}

std::shared_ptr<Shape> make_ply(Parameters& p) {
  MeshPlacement placement = placement_of(p);
  placement.flip_tex_coords = p.get_bool("flip_tex_coords", false);
  const std::vector<std::string> wanted = wanted_attributes(p.object());
  if (const std::string* data = find_embedded(p))
    return finish(p, read_ply(std::as_bytes(std::span(*data)), wanted), placement);
  return make_from_file(p, placement, [&](const FileView& view) { return read_ply(view.bytes(), wanted); });
}

std::shared_ptr<Shape> make_serialized(Parameters& p) {
  const MeshPlacement placement = placement_of(p);
  const int index = p.get_int("shape_index", 0, 0, std::numeric_limits<int>::max());
  return make_from_file(p, placement, [&](const FileView& view) { return read_serialized(view.bytes(), index); });
}

/// The square [-1, 1]^2 in the plane z = 0, normal +z, (u, v) from (0, 0) at (-1, -1) to (1, 1).
std::shared_ptr<Shape> make_rectangle(Parameters& p) {
  MeshFile file;
  MeshData& mesh = file.mesh;
  mesh.positions = {{-1, -1, 0}, {1, -1, 0}, {-1, 1, 0}, {1, 1, 0}};
  mesh.normals.assign(4, {0, 0, 1});
  mesh.uvs = {{0, 0}, {1, 0}, {0, 1}, {1, 1}};
  mesh.triangles = {{1, 2, 0}, {1, 3, 2}};
  return finish(p, std::move(file), placement_of(p));
}

/// [-1, 1]^3; every face carries the whole unit square of (u, v).
std::shared_ptr<Shape> make_cube(Parameters& p) {
  // Per face: its normal, and its corners in the order (u, v) = (0, 1), (1, 1), (1, 0), (0, 0).
  struct Face {
    Vec3 normal;
    Vec3 corners[4];
  };
  static const Face kFaces[6] = {{{0, -1, 0}, {{1, -1, -1}, {1, -1, 1}, {-1, -1, 1}, {-1, -1, -1}}},
                                 {{0, 1, 0}, {{1, 1, -1}, {-1, 1, -1}, {-1, 1, 1}, {1, 1, 1}}},
                                 {{1, 0, 0}, {{1, -1, -1}, {1, 1, -1}, {1, 1, 1}, {1, -1, 1}}},
                                 {{0, 0, 1}, {{1, -1, 1}, {1, 1, 1}, {-1, 1, 1}, {-1, -1, 1}}},
                                 {{-1, 0, 0}, {{-1, -1, 1}, {-1, 1, 1}, {-1, 1, -1}, {-1, -1, -1}}},
                                 {{0, 0, -1}, {{1, 1, -1}, {1, -1, -1}, {-1, -1, -1}, {-1, 1, -1}}}};
  static constexpr Vec2 kUvs[4] = {{0, 1}, {1, 1}, {1, 0}, {0, 0}};
  MeshFile file;
  MeshData& mesh = file.mesh;
  for (uint32_t f = 0; f < 6; ++f) {
    for (int k = 0; k < 4; ++k) {
      mesh.positions.push_back(kFaces[f].corners[k]);
      mesh.normals.push_back(kFaces[f].normal);
      mesh.uvs.push_back(kUvs[k]);
    }
    mesh.triangles.push_back({4 * f, 4 * f + 1, 4 * f + 2});
    mesh.triangles.push_back({4 * f + 3, 4 * f, 4 * f + 2});
  }
  return finish(p, std::move(file), placement_of(p));
}

std::shared_ptr<Shape> make_sphere(Parameters& p) {
  const Vec3 center = p.get_vec3("center", {0, 0, 0});
  const float radius = p.get_float("radius", 1, 0, kHuge);
  if (radius == 0) throw Error(ErrorCode::kInput, "the radius is 0; it must be positive");
  return std::make_shared<Sphere>(p.get_transform("to_world"), center, radius, p.get_bool("flip_normals", false));
}

std::shared_ptr<Shape> make_disk(Parameters& p) {
  return std::make_shared<Disk>(p.get_transform("to_world"), p.get_bool("flip_normals", false));
}

std::shared_ptr<Shape> make_cylinder(Parameters& p) {
  const Vec3 p0 = p.get_vec3("p0", {0, 0, 0}), p1 = p.get_vec3("p1", {0, 0, 1});
  const float radius = p.get_float("radius", 1, 0, kHuge);
  if (radius == 0) throw Error(ErrorCode::kInput, "the radius is 0; it must be positive");
  if (p0 == p1) throw Error(ErrorCode::kInput, "p0 and p1 are the same point");
  return std::make_shared<Cylinder>(p.get_transform("to_world"), p0, p1, radius, p.get_bool("flip_normals", false));
}

std::shared_ptr<Shape> make_curves(Parameters& p, CurveKind kind) {
  const Transform to_world = p.get_transform("to_world");
  p.get_float("silhouette_sampling_weight", 1);  // of Mitsuba's derivatives
  if (const std::string* data = find_embedded(p)) return read_curves(*data, kind, to_world);
  const std::string path = p.require_file("filename");
  if (path.empty()) return nullptr;
  try {
    const FileView view(path);
    require_memory(path, "its curves", 3 * static_cast<double>(view.bytes().size()));
    return read_curves(view.text(), kind, to_world);
  } catch (const Error& error) {
    p.error_at("filename", fmt::format("names '{}': {}", p.get_string("filename", ""), error.what()));
    return nullptr;
  }
}

std::shared_ptr<Shape> make_sdfgrid(Parameters& p) {
  const Transform to_world = p.get_transform("to_world");
  const bool smooth = p.get_choice("normals", "smooth", {"smooth", "analytic"}) == "smooth";
  const bool flip_normals = p.get_bool("flip_normals", false);
  const std::string path = p.require_file("filename");
  if (path.empty()) return nullptr;
  try {
    VolumeFile file = read_volume_file(path);
    if (file.channels != 1)
      throw Error(ErrorCode::kInput, fmt::format("it has {} channels; expected one", file.channels));
    return std::make_shared<SdfGrid>(
        to_world, SdfValues{{file.size[0], file.size[1], file.size[2]}, std::move(file.values)}, smooth, flip_normals);
  } catch (const Error& error) {
    p.error_at("filename", fmt::format("names '{}': {}", p.get_string("filename", ""), error.what()));
    return nullptr;
  }
}

std::shared_ptr<Shape> make_bsplinecurve(Parameters& p) { return make_curves(p, CurveKind::kBspline); }
std::shared_ptr<Shape> make_linearcurve(Parameters& p) { return make_curves(p, CurveKind::kLinear); }

}  // namespace

std::span<const Plugin<Shape>> shape_plugins() {
  static constexpr Plugin<Shape> kPlugins[] = {
      {"bsplinecurve", make_bsplinecurve},
      {"cube", make_cube},
      {"cylinder", make_cylinder},
      {"disk", make_disk},
      {"linearcurve", make_linearcurve},
      {"obj", make_obj},
      {"ply", make_ply},
      {"rectangle", make_rectangle},
      {"sdfgrid", make_sdfgrid},
      {"serialized", make_serialized},
      {"sphere", make_sphere},
  };
  return kPlugins;
}

}  // namespace covary
