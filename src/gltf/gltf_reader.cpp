// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "core/content_hash.h"
#include "gltf/gltf_materials.h"
#include "gltf/gltf_meshes.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

constexpr size_t kMostObjects = 1000000;
constexpr int64_t kHeight = 720, kMostWidth = 7200, kSamples = 64;  // the file only gives the aspect ratio
constexpr double kDegrees = 180 / M_PI;

/// glTF's cameras and lights look along -z, ours along +z.
Transform about_face() { return Transform::scale({-1, 1, -1}); }

/// The node's local transformation. Throws Error(kInput) if it is singular.
Transform transform_of(const tinygltf::Node& node) {
  Matrix4 m = Transform().matrix();
  if (node.matrix.size() == 16) {
    for (size_t i = 0; i < 16; ++i) m[i % 4][i / 4] = node.matrix[i];
    return Transform(m);
  }
  const auto or_else = [](const std::vector<double>& given, std::vector<double> fallback) {
    return given.size() == fallback.size() ? given : fallback;
  };
  const std::vector<double> t = or_else(node.translation, {0, 0, 0}), s = or_else(node.scale, {1, 1, 1});
  std::vector<double> q = or_else(node.rotation, {0, 0, 0, 1});
  const double norm = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  if (!(norm > 0)) throw Error(ErrorCode::kInput, "the rotation is zero");
  for (double& x : q) x /= norm;
  const double x = q[0], y = q[1], z = q[2], w = q[3];
  const double r[3][3] = {{1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)},
                          {2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)},
                          {2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)}};
  for (size_t i = 0; i < 3; ++i) {
    for (size_t k = 0; k < 3; ++k) m[i][k] = r[i][k] * s[k];
    m[i][3] = t[i];
  }
  return Transform(m);
}

/// The transformation without its scale.
Transform rigid(const Transform& t) {
  Matrix4 m = t.matrix();
  for (size_t k = 0; k < 3; ++k) {
    const double length = std::sqrt(m[0][k] * m[0][k] + m[1][k] * m[1][k] + m[2][k] * m[2][k]);
    for (size_t i = 0; i < 3; ++i) m[i][k] /= length;
  }
  return Transform(m);
}

class Reader {
 public:
  Reader(GltfFile& file) : file_(file), model_(file.model()), materials_(file) {
    scene_ = make_object("scene", "scene", file.where());
  }

  std::shared_ptr<const ObjectDescription> read() {
    count_meshes();
    walk();
    if (!sensor_) look_at_everything();
    if (!has_light_) {
      file_.warn("the file has no light: it is lit from all sides");
      auto sky = make_object("emitter", "constant", file_.where(), {{"radiance", 1.0}});
      add(sky);
    }
    add(sensor_);
    add(make_object("integrator", "path", file_.where()));
    if (!model_.animations.empty()) file_.warn("animations are not read: all is where it stands before they begin");
    if (!model_.skins.empty()) file_.warn("skins are not read: meshes are as they are before they are deformed");
    return scene_;
  }

 private:
  struct Place {
    int node;
    Transform to_world;
  };

  std::vector<int> roots() const {
    if (model_.scenes.empty()) {
      std::vector<bool> is_child(model_.nodes.size());
      for (const tinygltf::Node& node : model_.nodes)
        for (const int child : node.children)
          if (child >= 0 && static_cast<size_t>(child) < is_child.size()) is_child[child] = true;
      std::vector<int> all;
      for (size_t i = 0; i < is_child.size(); ++i)
        if (!is_child[i]) all.push_back(static_cast<int>(i));
      return all;
    }
    const int scene = model_.defaultScene;
    return model_.scenes[scene >= 0 && static_cast<size_t>(scene) < model_.scenes.size() ? scene : 0].nodes;
  }

  void count_meshes() {
    n_uses_.resize(model_.meshes.size());
    for (const tinygltf::Node& node : model_.nodes)
      if (node.mesh >= 0 && static_cast<size_t>(node.mesh) < n_uses_.size()) ++n_uses_[node.mesh];
    groups_.resize(model_.meshes.size());
  }

  /// Visits the nodes of the scene in file order.
  void walk() {
    std::vector<bool> seen(model_.nodes.size());
    std::vector<Place> open;
    const auto push = [&](const std::vector<int>& nodes, const Transform& to_world) {
      for (auto it = nodes.rbegin(); it != nodes.rend(); ++it) open.push_back({*it, to_world});
    };
    push(roots(), Transform());
    while (!open.empty()) {
      const Place place = open.back();
      open.pop_back();
      if (place.node < 0 || static_cast<size_t>(place.node) >= seen.size() || seen[place.node]) {
        file_.error(fmt::format("node {} is not there, or has several parents", place.node));
        continue;
      }
      seen[place.node] = true;
      const tinygltf::Node& node = model_.nodes[place.node];
      try {
        const Transform to_world = place.to_world * transform_of(node);
        // The test for singularity uses the 16 numbers.
        visit(node, place.to_world.is_identity() ? to_world : Transform(to_world.matrix()));
        push(node.children, to_world);
      } catch (const Error& error) {
        file_.warn(fmt::format("node {} '{}' is left out: {}", place.node, node.name, error.what()));
      }
    }
  }

  void visit(const tinygltf::Node& node, const Transform& to_world) {
    if (node.mesh >= 0) place_mesh(node.mesh, to_world);
    if (node.camera >= 0) place_camera(node.camera, rigid(to_world));
    if (const tinygltf::Value* khr = find_extension(node.extensions, "KHR_lights_punctual"))
      place_light(static_cast<int>(extension_number(*khr, "light", -1)), rigid(to_world));
  }

  // ---- meshes ----

  struct Part {
    ObjectBuilder shape;
    Bounds3 bounds;
  };

  std::vector<Part> parts_of(int mesh) {
    std::vector<Part> parts;
    const tinygltf::Mesh& given = model_.meshes[mesh];
    for (size_t i = 0; i < given.primitives.size(); ++i) {
      const tinygltf::Primitive& primitive = given.primitives[i];
      const std::string what = fmt::format("mesh {} '{}', primitive {}", mesh, given.name, i);
      const auto read = read_gltf_mesh(file_, primitive, materials_.texture_set(primitive.material), what);
      if (!read) continue;
      Part part{make_object("shape", "ply", file_.where()), {}};
      for (size_t v = 0; v < read->mesh.positions.size(); v += 3) {
        const auto x = [&](size_t k) { return static_cast<float>(read->mesh.positions[v + k]); };
        part.bounds.extend(Vec3{x(0), x(1), x(2)});
      }
      set_property(*part.shape, std::string(kEmbeddedData), ply_text(read->mesh));
      if (!read->smooth) set_property(*part.shape, "face_normals", true);
      set_property(*part.shape, "", materials_.model(primitive.material));
      if (const ObjectPtr light = materials_.light(primitive.material)) {
        set_property(*part.shape, "", light);
        has_light_ = true;
      }
      parts.push_back(std::move(part));
    }
    return parts;
  }

  void place_mesh(int mesh, const Transform& to_world) {
    if (static_cast<size_t>(mesh) >= model_.meshes.size()) {
      file_.error(fmt::format("there is no mesh {}", mesh));
      return;
    }
    const auto extend = [&](const Bounds3& bounds) {
      if (!bounds.empty()) bounds_.extend(to_world.bounds(bounds));
    };
    if (n_uses_[mesh] == 1) {
      for (const Part& part : parts_of(mesh)) {
        set_property(*part.shape, "to_world", to_world);
        extend(part.bounds);
        add(part.shape);
      }
      return;
    }
    Group& group = groups_[mesh];
    if (!group.made) {
      group.made = true;
      auto shapes = make_object("shape", "shapegroup", file_.where());
      for (const Part& part : parts_of(mesh)) {
        set_property(*shapes, "", ObjectPtr(part.shape));
        group.bounds.extend(part.bounds);
      }
      if (!shapes->properties.empty()) group.shapes = shapes;
      if (group.shapes) add(group.shapes);
    }
    if (!group.shapes) return;
    auto instance = make_object("shape", "instance", file_.where(), {{"to_world", to_world}, {"", group.shapes}});
    extend(group.bounds);
    add(instance);
  }

  // ---- cameras ----

  ObjectBuilder make_sensor(const char* type, double aspect) {
    auto film = make_object("film", "hdrfilm", file_.where());
    const double width = std::round(static_cast<double>(kHeight) * aspect);
    set_property(*film, "width", static_cast<int64_t>(std::clamp(width, 1.0, static_cast<double>(kMostWidth))));
    set_property(*film, "height", kHeight);
    auto sampler = make_object("sampler", "independent", file_.where(), {{"sample_count", kSamples}});
    return make_object("sensor", type, file_.where(), {{"", ObjectPtr(film)}, {"", ObjectPtr(sampler)}});
  }

  void place_camera(int index, const Transform& to_world) {
    if (static_cast<size_t>(index) >= model_.cameras.size()) {
      file_.error(fmt::format("there is no camera {}", index));
      return;
    }
    if (sensor_) {
      file_.warn("the file has several cameras: the first is taken");
      return;
    }
    const tinygltf::Camera& camera = model_.cameras[index];
    if (camera.type == "orthographic") {
      const double x = camera.orthographic.xmag, y = camera.orthographic.ymag;
      if (!(x > 0 && y > 0)) return file_.error(fmt::format("camera '{}' is {} wide and {} high", camera.name, x, y));
      sensor_ = make_sensor("orthographic", x / y);
      const auto half = static_cast<float>(x);
      set_property(*sensor_, "to_world", to_world * about_face() * Transform::scale({half, half, 1}));
      return;
    }
    const double fov = camera.perspective.yfov * kDegrees, aspect = camera.perspective.aspectRatio;
    if (!(fov > 0 && fov < 180))
      return file_.error(fmt::format("camera '{}' has a field of view of {}", camera.name, fov));
    sensor_ = make_sensor("perspective", aspect > 0 ? aspect : 16.0 / 9);
    set_property(*sensor_, "fov", fov);
    set_property(*sensor_, "fov_axis", std::string("y"));
    set_property(*sensor_, "near_clip", std::max(camera.perspective.znear, 1e-6));
    set_property(*sensor_, "far_clip", std::max(camera.perspective.zfar, 1e7));
    set_property(*sensor_, "to_world", to_world * about_face());
  }

  /// From the front, slightly from above and from the right.
  void look_at_everything() {
    if (bounds_.empty()) {
      file_.error("the file has neither a camera nor a mesh");
      return;
    }
    file_.warn("the file has no camera: it is seen from the front, a little from above");
    constexpr double kFov = 40;
    const float radius = std::max(bounds_.radius(), 1e-6f);
    const float distance = radius / static_cast<float>(std::sin(kFov / 2 / kDegrees));
    sensor_ = make_sensor("perspective", 16.0 / 9);
    set_property(*sensor_, "fov", kFov);
    set_property(*sensor_, "fov_axis", std::string("y"));
    set_property(*sensor_, "near_clip", static_cast<double>(distance) * 1e-4);
    set_property(*sensor_, "far_clip", static_cast<double>(distance) * 1e4);
    const Vec3 from = bounds_.center() + normalize(Vec3{0.4f, 0.35f, 1}) * distance;
    set_property(*sensor_, "to_world", Transform::look_at(from, bounds_.center(), {0, 1, 0}));
  }

  // ---- lights ----

  void place_light(int index, const Transform& to_world) {
    if (index < 0 || static_cast<size_t>(index) >= model_.lights.size()) {
      file_.error(fmt::format("there is no light {}", index));
      return;
    }
    const tinygltf::Light& given = model_.lights[index];
    Spectrum colour(static_cast<float>(given.intensity));
    for (int c = 0; c < 3; ++c)
      if (given.color.size() == 3) colour[c] *= static_cast<float>(given.color[c]);
    if (!(max_component(colour) > 0)) return;
    has_light_ = true;
    auto light = make_object("emitter", given.type, file_.where());
    if (given.type == "directional") {
      set_property(*light, "irradiance", ColourValue{colour});
      set_property(*light, "direction", to_world.vector({0, 0, -1}));
    } else if (given.type == "point") {
      set_property(*light, "intensity", ColourValue{colour});
      set_property(*light, "position", to_world.point({0, 0, 0}));
    } else if (given.type == "spot") {
      set_property(*light, "intensity", ColourValue{colour});
      set_property(*light, "cutoff_angle", given.spot.outerConeAngle * kDegrees);
      set_property(*light, "beam_width", given.spot.innerConeAngle * kDegrees);
      set_property(*light, "falloff", std::string("squared"));
      set_property(*light, "to_world", to_world * about_face());
    } else {
      file_.error(fmt::format("light '{}' is of the type '{}', which there is not", given.name, given.type));
      return;
    }
    add(light);
  }

  void add(const ObjectPtr& object) {
    if (object && scene_->properties.size() < kMostObjects)
      set_property(*scene_, "", object);
    else if (object)
      throw Error(ErrorCode::kInput, fmt::format("{}: more than {} objects", file_.where().text(), kMostObjects));
  }

  struct Group {
    bool made = false;
    ObjectPtr shapes;
    Bounds3 bounds;
  };

  GltfFile& file_;
  const tinygltf::Model& model_;
  GltfMaterials materials_;
  ObjectBuilder scene_, sensor_;
  std::vector<size_t> n_uses_;
  std::vector<Group> groups_;
  Bounds3 bounds_;
  bool has_light_ = false;
};

}  // namespace

SceneXml read_scene_gltf(std::string_view bytes, const std::string& name, FileResolver& files,
                         Diagnostics& diagnostics) {
  const std::string folder = std::filesystem::path(name).parent_path().string();
  files.add_folder(folder.empty() ? "." : folder);
  GltfFile file(bytes, name, files, diagnostics);
  SceneXml result;
  result.scene = Reader(file).read();
  result.hash = hash_bytes(bytes);
  return result;
}

}  // namespace covary
