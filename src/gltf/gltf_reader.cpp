// SPDX-License-Identifier: Apache-2.0
#include "gltf/gltf_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <tuple>

#include "core/content_hash.h"
#include "gltf/gltf_animation.h"
#include "gltf/gltf_materials.h"
#include "gltf/gltf_meshes.h"
#include "gltf/gltf_nodes.h"
#include "scene/embedded_data.h"

namespace covary {
namespace {

constexpr size_t kMaxObjects = 1000000;
constexpr int64_t kHeight = 720, kMaxWidth = 7200, kSamples = 64;  // the file only gives the aspect ratio
constexpr double kDegrees = 180 / M_PI;

/// glTF's cameras and lights look along -z, ours along +z.
Transform about_face() { return Transform::scale({-1, 1, -1}); }

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
  explicit Reader(GltfFile& file) : file_(file), model_(file.model()), nodes_(file), materials_(file) {
    scene_ = make_object("scene", "scene", file.where());
  }

  std::shared_ptr<const ObjectDescription> read() {
    n_uses_.resize(model_.meshes.size());
    for (const GltfNodes::Place& place : nodes_.places())
      if (const int mesh = model_.nodes[place.node].mesh; mesh >= 0 && static_cast<size_t>(mesh) < n_uses_.size())
        n_uses_[mesh] += std::max<size_t>(nodes_.instances(model_.nodes[place.node]).size(), 1);
    for (const GltfNodes::Place& place : nodes_.places()) visit(model_.nodes[place.node], place.to_world);
    add(make_object("integrator", "path", file_.where()));
    if (!has_mesh_ && !has_camera_) file_.error("the file has neither a camera nor a mesh");
    return scene_;
  }

 private:
  void visit(const tinygltf::Node& node, const Transform& to_world) {
    if (node.mesh >= 0) place_mesh(node, to_world);
    if (node.camera >= 0) place_camera(node, rigid(to_world));
    if (const tinygltf::Value* khr = find_extension(node.extensions, "KHR_lights_punctual"))
      place_light(extension_index(*khr, "light"), rigid(to_world));
  }

  // ---- meshes ----

  /// The shapes of a mesh as a node deforms it.
  std::vector<ObjectBuilder> parts_of(int mesh, const GltfPose& pose) {
    std::vector<ObjectBuilder> parts;
    const tinygltf::Mesh& given = model_.meshes[mesh];
    for (size_t i = 0; i < given.primitives.size(); ++i) {
      const tinygltf::Primitive& primitive = given.primitives[i];
      const std::string what = fmt::format("mesh {} '{}', primitive {}", mesh, given.name, i);
      const auto read = read_gltf_mesh(file_, primitive, materials_.sets(primitive.material), pose, what);
      if (!read) continue;
      auto part = make_object("shape", "ply", file_.where());
      set_property(*part, std::string(kEmbeddedData), ply_text(read->mesh));
      if (!read->smooth) set_property(*part, "face_normals", true);
      const GltfColours colours{!read->mesh.colours.empty(), read->transparent};
      set_property(*part, "", materials_.model(primitive.material, colours));
      if (const ObjectPtr light = materials_.light(primitive.material, colours)) set_property(*part, "", light);
      if (const ObjectPtr inside = materials_.medium(primitive.material)) set_property(*part, "interior", inside);
      parts.push_back(std::move(part));
    }
    return parts;
  }

  bool has_media(const tinygltf::Mesh& mesh) {
    return std::any_of(mesh.primitives.begin(), mesh.primitives.end(),
                       [&](const tinygltf::Primitive& p) { return materials_.medium(p.material) != nullptr; });
  }

  void place_mesh(const tinygltf::Node& node, const Transform& to_world) {
    if (static_cast<size_t>(node.mesh) >= model_.meshes.size())
      return file_.error(fmt::format("there is no mesh {}", node.mesh));
    has_mesh_ = true;
    const tinygltf::Mesh& mesh = model_.meshes[node.mesh];
    const std::vector<double>& weights = node.weights.empty() ? mesh.weights : node.weights;
    const std::vector<Transform> joints = node.skin >= 0 ? nodes_.joints(node.skin) : std::vector<Transform>();
    if (!joints.empty()) return place_parts(node.mesh, {weights, joints}, {Transform()});
    std::vector<Transform> places = nodes_.instances(node);
    for (Transform& place : places) place = to_world * place;
    if (places.empty()) places = {to_world};
    // Shapes of a group cannot have a medium.
    if (n_uses_[node.mesh] == 1 || has_media(mesh)) return place_parts(node.mesh, {weights, {}}, places);
    const auto [found, is_new] = groups_.try_emplace({node.mesh, weights});
    if (is_new) {
      auto shapes = make_object("shape", "shapegroup", file_.where());
      for (const ObjectBuilder& part : parts_of(node.mesh, {weights, {}})) set_property(*shapes, "", ObjectPtr(part));
      if (!shapes->properties.empty()) add(found->second = shapes);
    }
    if (!found->second) return;
    for (const Transform& place : places)
      add(make_object("shape", "instance", file_.where(), {{"to_world", place}, {"", found->second}}));
  }

  void place_parts(int mesh, const GltfPose& pose, const std::vector<Transform>& places) {
    const std::vector<ObjectBuilder> parts = parts_of(mesh, pose);
    for (const Transform& place : places)
      for (const ObjectBuilder& part : parts) {
        const auto placed = &place == &places.back() ? part : std::make_shared<ObjectDescription>(*part);
        set_property(*placed, "to_world", place);
        add(placed);
      }
  }

  // ---- cameras ----

  ObjectBuilder make_sensor(const char* type, double aspect) {
    auto film = make_object("film", "hdrfilm", file_.where());
    const double width = std::round(static_cast<double>(kHeight) * aspect);
    set_property(*film, "width", static_cast<int64_t>(std::clamp(width, 1.0, static_cast<double>(kMaxWidth))));
    set_property(*film, "height", kHeight);
    auto sampler = make_object("sampler", "independent", file_.where(), {{"sample_count", kSamples}});
    return make_object("sensor", type, file_.where(), {{"", ObjectPtr(film)}, {"", ObjectPtr(sampler)}});
  }

  void place_camera(const tinygltf::Node& node, const Transform& to_world) {
    if (static_cast<size_t>(node.camera) >= model_.cameras.size())
      return file_.error(fmt::format("there is no camera {}", node.camera));
    const tinygltf::Camera& camera = model_.cameras[node.camera];
    has_camera_ = true;
    ObjectBuilder sensor;
    if (camera.type == "orthographic") {
      const double x = camera.orthographic.xmag, y = camera.orthographic.ymag;
      if (!(x > 0 && y > 0)) return file_.error(fmt::format("camera '{}' is {} wide and {} high", camera.name, x, y));
      sensor = make_sensor("orthographic", x / y);
      const auto half = static_cast<float>(x);
      set_property(*sensor, "to_world", to_world * about_face() * Transform::scale({half, half, 1}));
    } else {
      const double fov = camera.perspective.yfov * kDegrees, aspect = camera.perspective.aspectRatio;
      if (!(fov > 0 && fov < 180))
        return file_.error(fmt::format("camera '{}' has a field of view of {}", camera.name, fov));
      sensor = make_sensor("perspective", aspect > 0 ? aspect : 16.0 / 9);
      set_property(*sensor, "fov", fov);
      set_property(*sensor, "fov_axis", std::string("y"));
      set_property(*sensor, "near_clip", std::max(camera.perspective.znear, 1e-6));
      set_property(*sensor, "far_clip", std::max(camera.perspective.zfar, 1e7));
      set_property(*sensor, "to_world", to_world * about_face());
    }
    sensor->id = camera.name.empty() ? node.name : camera.name;
    add(sensor);
  }

  // ---- lights ----

  void place_light(int index, const Transform& to_world) {
    if (index < 0 || static_cast<size_t>(index) >= model_.lights.size())
      return file_.error(fmt::format("there is no light {}", index));
    const tinygltf::Light& given = model_.lights[index];
    Spectrum colour(static_cast<float>(given.intensity));
    for (int c = 0; c < 3; ++c)
      if (given.color.size() == 3) colour[c] *= static_cast<float>(given.color[c]);
    if (!(max_component(colour) > 0)) return;
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
      return file_.error(fmt::format("light '{}' is of the type '{}', which there is not", given.name, given.type));
    }
    add(light);
  }

  void add(const ObjectPtr& object) {
    if (scene_->properties.size() >= kMaxObjects)
      throw Error(ErrorCode::kInput, fmt::format("{}: more than {} objects", file_.where().text(), kMaxObjects));
    set_property(*scene_, "", object);
  }

  GltfFile& file_;
  const tinygltf::Model& model_;
  GltfNodes nodes_;
  GltfMaterials materials_;
  ObjectBuilder scene_;
  std::vector<size_t> n_uses_;                                       // of meshes
  std::map<std::pair<int, std::vector<double>>, ObjectPtr> groups_;  // by mesh and weights; null: nothing to place
  bool has_mesh_ = false, has_camera_ = false;
};

}  // namespace

SceneXml read_scene_gltf(std::string_view bytes, const std::string& name, FileResolver& files, Diagnostics& diagnostics,
                         std::optional<double> time) {
  const std::string folder = std::filesystem::path(name).parent_path().string();
  files.add_folder(folder.empty() ? "." : folder);
  GltfFile file(bytes, name, files, diagnostics);
  SceneXml result;
  result.is_animated = !file.animations().empty();
  result.hash = hash_bytes(bytes);
  if (file.moves_pointers())
    file.warn("animations of materials and other properties (KHR_animation_pointer) are not read");
  if (result.is_animated && time) {
    move_gltf_nodes(file, *time);
    result.hash = hash_bytes(fmt::format("{} {}", result.hash, *time));
  } else if (result.is_animated) {
    file.warn("is animated: all is where it stands at rest; `--frames` shows it in motion");
  }
  result.scene = Reader(file).read();
  return result;
}

}  // namespace covary
