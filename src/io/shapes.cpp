// SPDX-License-Identifier: Apache-2.0
// Shapes by the names used in scene files.
//
// | parameter       | type      | default | meaning                                                              |
// |-----------------|-----------|---------|----------------------------------------------------------------------|
// | to_world        | transform | none    | from object space to world space                                     |
// | flip_normals    | boolean   | false   | turn the surface inside out                                          |
// | face_normals    | boolean   | false   | meshes: flat shading                                                 |
// | filename        | string    |         | obj, ply, serialized, linearcurve, bsplinecurve                      |
// | flip_tex_coords | boolean   | see     | obj (true), ply (false): v becomes 1 - v                             |
// | shape_index     | integer   | 0       | serialized: which mesh of the file                                   |
// | center, radius  |           | 0, 1    | sphere                                                               |
// | p0, p1, radius  |           | 0, z, 1 | cylinder                                                             |
#include "io/shapes.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "core/memory_limit.h"
#include "formats/file_resolver.h"
#include "formats/object_builder.h"
#include "formats/xml_values.h"
#include "media/volume_file.h"
#include "meshes/mesh_file.h"
#include "scene/analytic_shape.h"
#include "scene/embedded_data.h"
#include "scene/mesh.h"
#include "scene/sdf_grid.h"

namespace covary {
namespace {

constexpr float kLargestRadius = std::numeric_limits<float>::max();

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
    // Estimated at three times the file: the arrays as read, and as kept.
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

/// [-1, 1]^3; (u, v) cover the unit square on every face.
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
  const float radius = p.get_float("radius", 1, 0, kLargestRadius);
  if (radius == 0) throw Error(ErrorCode::kInput, "the radius is 0; it must be positive");
  return std::make_shared<Sphere>(p.get_transform("to_world"), center, radius, p.get_bool("flip_normals", false));
}

std::shared_ptr<Shape> make_disk(Parameters& p) {
  return std::make_shared<Disk>(p.get_transform("to_world"), p.get_bool("flip_normals", false));
}

std::shared_ptr<Shape> make_cylinder(Parameters& p) {
  const Vec3 p0 = p.get_vec3("p0", {0, 0, 0}), p1 = p.get_vec3("p1", {0, 0, 1});
  const float radius = p.get_float("radius", 1, 0, kLargestRadius);
  if (radius == 0) throw Error(ErrorCode::kInput, "the radius is 0; it must be positive");
  if (p0 == p1) throw Error(ErrorCode::kInput, "p0 and p1 are the same point");
  return std::make_shared<Cylinder>(p.get_transform("to_world"), p0, p1, radius, p.get_bool("flip_normals", false));
}

std::shared_ptr<Shape> make_curves(Parameters& p, CurveKind kind) {
  const Transform to_world = p.get_transform("to_world");
  p.get_float("silhouette_sampling_weight", 1);  // for Mitsuba's differentiable rendering
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

std::vector<std::string> wanted_attributes(const ObjectDescription& shape) {
  std::vector<std::string> names;
  visit_properties(shape, [&](const ObjectDescription& object, const Property& property) {
    if (object.kind != "texture" || object.type != "mesh_attribute" || property.name != "name") return;
    const std::string* name = std::get_if<std::string>(&property.value);
    if (name && std::find(names.begin(), names.end(), *name) == names.end()) names.push_back(*name);
  });
  std::sort(names.begin(), names.end());
  return names;
}

std::function<ShapePtr(const Transform&)> copies_of(const ShapePtr& shape, const AreaLight* light,
                                                    const SourceLocation& where) {
  return [shape, prototype = light ? light->clone() : nullptr, where](const Transform& to_world) {
    try {
      const ShapePtr copy = shape->transformed(to_world);
      copy->share_surface(*shape);
      if (prototype) {
        const std::shared_ptr<AreaLight> own = prototype->clone();
        own->attach(copy.get());
        copy->set_emitter(own);
      }
      return copy;
    } catch (const Error& error) {
      throw Error(error.code(), where.text() + ": " + error.what());
    }
  };
}

ObjectPtr in_own_space(const ObjectPtr& shape, KeyedTransformPtr& to_world) {
  for (const Property& property : shape->properties) {
    const KeyedTransformPtr* animation = std::get_if<KeyedTransformPtr>(&property.value);
    if (!animation || property.name != "to_world") continue;
    to_world = *animation;
    auto rest = std::make_shared<ObjectDescription>(*shape);
    std::erase_if(rest->properties, [](const Property& p) { return p.name == "to_world"; });
    return rest;
  }
  return shape;
}

namespace {

class Reader {
 public:
  Reader(CurveKind kind, const Transform& to_world)
      : min_points_(kind == CurveKind::kLinear ? 2 : 4), to_world_(to_world) {}

  void read(std::string_view text) {
    while (!text.empty()) {
      ++line_;
      const size_t end = std::min(text.find('\n'), text.size());
      std::string_view line = text.substr(0, end);
      if (line.ends_with('\r')) line.remove_suffix(1);
      text.remove_prefix(std::min(end + 1, text.size()));
      const bool blank = line.find_first_not_of(" \t") == std::string_view::npos;
      blank ? end_curve() : add_point(line);
    }
    end_curve();
  }
  std::vector<CurvePoint> points;
  std::vector<uint32_t> segments;

 private:
  void add_point(std::string_view line) {
    try {
      const std::vector<double> v = parse_numbers(line, 4);
      const Vec3 p = to_world_.point({static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])});
      if (v[3] < 0) throw Error(ErrorCode::kInput, fmt::format("the radius is {}; it must not be negative", v[3]));
      points.push_back({p.x, p.y, p.z, static_cast<float>(v[3])});
    } catch (const Error& error) {
      throw Error(ErrorCode::kInput, fmt::format("line {}: {}", line_, error.what()));
    }
  }
  void end_curve() {
    const size_t n = points.size() - first_;
    if (n == 0) return;
    if (n < min_points_)
      throw Error(ErrorCode::kInput, fmt::format("line {}: the curve before it has {} control points; at least {} are "
                                                 "needed",
                                                 line_, n, min_points_));
    for (size_t i = first_; i + min_points_ <= points.size(); ++i) segments.push_back(static_cast<uint32_t>(i));
    first_ = points.size();
  }

  size_t min_points_, first_ = 0, line_ = 0;
  Transform to_world_;
};

}  // namespace

std::shared_ptr<CurveShape> read_curves(std::string_view text, CurveKind kind, const Transform& to_world) {
  Reader reader(kind, to_world);
  reader.read(text);
  return std::make_shared<CurveShape>(kind, std::move(reader.points), std::move(reader.segments));
}

void require_emission(Parameters& parameters, const Shape& shape) {
  if (!shape.can_emit()) return parameters.error("cannot emit light");
  const auto* mesh = dynamic_cast<const TriangleMesh*>(&shape);
  if (!mesh) return;
  if (mesh->triangles().empty()) parameters.error("cannot emit light: its mesh has no triangle of positive area");
  for (const auto& t : mesh->triangles()) {
    const Vec3 &a = mesh->vertices()[t[0]].p, &b = mesh->vertices()[t[1]].p, &c = mesh->vertices()[t[2]].p;
    if (!std::isfinite(length(cross(b - a, c - a))))
      return parameters.error(fmt::format(
          "cannot emit light: a triangle at ({}, {}, {}) is too large for its area to be a float", a.x, a.y, a.z));
  }
}

}  // namespace covary
