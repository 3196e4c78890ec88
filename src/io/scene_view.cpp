// SPDX-License-Identifier: Apache-2.0
#include "io/scene_view.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>

#include "core/error.h"
#include "core/known_names.h"
#include "core/number_text.h"
#include "formats/object_builder.h"
#include "gltf/gltf_reader.h"
#include "io/studio.h"
#include "scene/embedded_data.h"
#include "scene/mesh.h"

namespace covary {
namespace {

constexpr double kFov = 40, kMargin = 0.88;  // of a framed camera: degrees along the shorter side; how far it is filled

std::string read_background(const std::string& text, std::optional<Spectrum>& background) {
  for (const int n : {1, 3})
    if (const auto values = parse_reals(text, ',', n);
        values && std::all_of(values->begin(), values->end(), [](double x) { return x >= 0 && x <= 1e6; })) {
      const auto at = [&](int c) { return static_cast<float>((*values)[n == 1 ? 0 : c]); };
      background = Spectrum(at(0), at(1), at(2));
      return "";
    }
  return "a grey or R,G,B, linear numbers from 0 on, e.g. 0.8 or 0.1,0.2,0.4";
}

std::vector<ObjectPtr> sensors_of(const ObjectDescription& scene) {
  std::vector<ObjectPtr> sensors;
  for (const Property& property : scene.properties)
    if (const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value))
      if (*object && (*object)->kind == "sensor") sensors.push_back(*object);
  return sensors;
}

/// The objects of that kind nested in another.
ObjectPtr child_of(const ObjectDescription* parent, const std::string& kind) {
  if (parent)
    for (const Property& property : parent->properties)
      if (const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value))
        if (*child && (*child)->kind == kind) return *child;
  return nullptr;
}

/// Whether lights other than `weak` ones shine on the scene.
bool has_light(const SceneParts& parts, const Bounds3& bounds, bool weak_lights) {
  if (parts.media_emit) return true;
  if (!weak_lights) return !parts.emitters.empty();
  for (const ShapePtr& shape : parts.shapes)
    if (auto* mesh = dynamic_cast<TriangleMesh*>(shape.get()); mesh && mesh->emitter()) mesh->prepare_sampling();
  // The mean irradiance of the bounding sphere is power / (4 pi r^2); in white surroundings of radiance 1 it is pi.
  double power = 0;
  for (const auto& emitter : parts.emitters) {
    if (emitter->is_infinite() || emitter->is_delta()) return true;
    if (emitter->group() == kUnlit) continue;
    power += max_component(emitter->power());
  }
  const double radius = bounds.radius();
  return power > 0.05 * kPi * 4 * kPi * radius * radius;
}

/// Rotation by which the local axes y and z become the scene's up and front.
Transform turned(const Vec3& up, const Vec3& front) {
  const Vec3 right = cross(up, front);
  Matrix4 m = Transform().matrix();
  for (size_t i = 0; i < 3; ++i) m[i][0] = right[i], m[i][1] = up[i], m[i][2] = front[i];
  return Transform(m);
}

/// The part of `v` that is perpendicular to the unit vector `up`, normalised; `fallback` if there is none.
Vec3 level(const Vec3& v, const Vec3& up, const Vec3& fallback) {
  const Vec3 flat = v - up * dot(v, up);
  return length(flat) > 1e-3f * length(v) ? normalize(flat) : fallback;
}

/// A disk under the scene, unless the camera is inside the scene or below.
ObjectPtr studio_floor(const Bounds3& bounds, const CameraSettings& camera, const Vec3& up, const Vec3& front,
                       const SourceLocation& where) {
  const Vec3 from = camera.to_world.point({0, 0, 0});
  const float radius = bounds.radius();
  const auto height = [&](const Vec3& p) { return dot(p - bounds.center(), up); };
  float lowest = 0;
  for (int axis = 0; axis < 3; ++axis) lowest -= std::abs(up[axis]) * (bounds.upper[axis] - bounds.lower[axis]) / 2;
  lowest -= 2e-3f * radius;
  bool inside = true;
  for (int axis = 0; axis < 3; ++axis)
    inside = inside && from[axis] > bounds.lower[axis] && from[axis] < bounds.upper[axis];
  if (inside || height(from) < lowest + 0.05f * radius) return nullptr;
  const Vec3 center = bounds.center() + up * lowest;
  const float reach = 60 * std::max(radius, length(from - bounds.center()));
  const Transform to_world = Transform::translate(center) * turned(up, front) * Transform::rotate({1, 0, 0}, -90) *
                             Transform::scale({reach, reach, reach});
  const ObjectPtr grey = make_object("bsdf", "diffuse", where, {{"reflectance", ColourValue{Spectrum(kStudioFloor)}}});
  return make_object("shape", "disk", where, {{"to_world", to_world}, {"", grey}});
}

ObjectPtr sky(const Vec3& up, const Vec3& front, const SourceLocation& where) {
  const Vec3 right = cross(up, front), sun = normalize(front - right + up * 1.4f);
  // z is up there; a white level surface reflects about 1.
  return make_object("emitter", "sunsky", where,
                     {{"to_world", turned(up, front) * Transform::rotate({1, 0, 0}, -90)},
                      {"sun_direction", sun},
                      {"sun_scale", 3.0},
                      {"sky_scale", 3.0}});
}

}  // namespace

void declare(Settings& s, SceneView& v) {
  s.group("Rendering", OptionEffect::kSamples);
  s.text("environment", v.environment, "auto|studio|sky|white|none|FILE",
         "Light from all around instead of the scene's own; auto: a studio with a floor if the scene has no light, or, "
         "in glTF, none that matters");
  s.text_as("background", v.background, "R,G,B", read_background,
            "Colour where the camera sees no surface, a linear grey or R,G,B; it sheds no light");
  s.text("camera", v.camera, "NAME|NUMBER|auto",
         "Which camera of the scene, by its name or number, from 1; auto: one that frames everything");
}

ObjectPtr chosen_sensor(const ObjectDescription& scene, const SceneView& view, Diagnostics& diagnostics) {
  const std::vector<ObjectPtr> sensors = sensors_of(scene);
  if (view.camera == "auto" || (sensors.empty() && view.camera.empty())) return nullptr;
  if (view.camera.empty()) {
    if (sensors.size() > 1)
      diagnostics.warn(sensors[1]->where,
                       fmt::format("the scene has {} cameras; the first{} is used (`camera` chooses)", sensors.size(),
                                   sensors[0]->id.empty() ? "" : ", '" + sensors[0]->id + "',"));
    return sensors[0];
  }
  std::string names;
  for (size_t i = 0; i < sensors.size(); ++i) {
    if (sensors[i]->id == view.camera || std::to_string(i + 1) == view.camera) return sensors[i];
    names += fmt::format("{}{}{}", i ? ", " : "", i + 1, sensors[i]->id.empty() ? "" : " '" + sensors[i]->id + "'");
  }
  diagnostics.error(scene.where,
                    fmt::format("there is no camera '{}'; {}", view.camera,
                                names.empty() ? "the scene has none: use auto" : "the scene has " + names));
  return nullptr;
}

ObjectPtr first_sensor(const ObjectDescription& scene) {
  const std::vector<ObjectPtr> sensors = sensors_of(scene);
  return sensors.empty() ? nullptr : sensors[0];
}

Orientation orientation_of(const CameraSettings* camera) {
  Orientation result;
  if (!camera) return result;
  const Vec3 up = camera->to_world.vector({0, 1, 0});
  int axis = 1;
  for (const int other : {2, 0})
    if (std::abs(up[other]) > std::abs(up[axis]) * 1.01f) axis = other;
  result.up = {};
  result.up[axis] = up[axis] < 0 ? -1.0f : 1.0f;
  result.front = axis == 1 ? Vec3{0, 0, 1} : Vec3{0, -1, 0};
  return result;
}

ObjectPtr framed_sensor(const Bounds3& bounds, const Orientation& orientation, const ObjectDescription* like,
                        float aspect, const SourceLocation& where) {
  const auto& [up, front] = orientation;
  const Vec3 right = cross(up, front), back = normalize(front + right * 0.4f + up * 0.35f);
  const Vec3 x = normalize(cross(up, back)), y = cross(back, x);
  const float slope = std::tan(static_cast<float>(kFov / 2 * kPi / 180)) * static_cast<float>(kMargin);
  const float slope_x = slope * std::max(aspect, 1.0f), slope_y = slope * std::max(1 / aspect, 1.0f);
  const float radius = std::max(bounds.radius(), 1e-6f);
  float distance = 0.1f * radius;
  for (int i = 0; i < 8; ++i) {
    const Vec3 corner{i & 1 ? bounds.upper.x : bounds.lower.x, i & 2 ? bounds.upper.y : bounds.lower.y,
                      i & 4 ? bounds.upper.z : bounds.lower.z};
    const Vec3 c = corner - bounds.center();
    distance =
        std::max(distance, dot(c, back) + std::max(std::abs(dot(c, x)) / slope_x, std::abs(dot(c, y)) / slope_y));
  }
  ObjectPtr film = child_of(like, "film"), sampler = child_of(like, "sampler");
  if (!film) film = make_object("film", "hdrfilm", where, {{"width", int64_t{1280}}, {"height", int64_t{720}}});
  if (!sampler) sampler = make_object("sampler", "independent", where, {{"sample_count", int64_t{64}}});
  const Vec3 from = bounds.center() + back * distance;
  return make_object("sensor", "perspective", where,
                     {{"fov", kFov},
                      {"fov_axis", std::string("smaller")},
                      {"near_clip", static_cast<double>(radius) * 1e-3},
                      {"far_clip", static_cast<double>(distance) * 1e4},
                      {"to_world", Transform::look_at(from, bounds.center(), up)},
                      {"", film},
                      {"", sampler}});
}

Bounds3 bounds_of(const SceneParts& parts) {
  Bounds3 bounds;
  for (const ShapePtr& shape : parts.shapes) bounds.extend(shape->bounds());
  for (const Instance& instance : parts.instances)
    for (const ShapePtr& shape : instance.group->shapes) bounds.extend(instance.to_world.bounds(shape->bounds()));
  return bounds;
}

std::string text_of(const SceneView& view, const std::vector<ObjectPtr>& added) {
  std::string text;
  for (const ObjectPtr& object : added) text += fmt::format(" {} {}", object->kind, object->type);
  if (!view.camera.empty()) text += " camera " + view.camera;
  if (const auto& b = view.background) text += fmt::format(" background {} {} {}", b->r, b->g, b->b);
  return text;
}

std::shared_ptr<const ObjectDescription> with_view(const ObjectDescription& scene, const SceneView& view,
                                                   const std::vector<ObjectPtr>& added, Diagnostics& diagnostics) {
  auto viewed = std::make_shared<ObjectDescription>(scene);
  const ObjectPtr sensor = view.camera.empty() ? nullptr : chosen_sensor(scene, view, diagnostics);
  std::erase_if(viewed->properties, [&](const Property& property) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (!object || !*object) return false;
    if ((*object)->kind == "sensor") return !view.camera.empty() && *object != sensor;
    static constexpr std::array kAllAround = {"constant", "envmap", "sunsky"};
    return (*object)->kind == "emitter" && view.replaces_environment() &&
           std::count(kAllAround.begin(), kAllAround.end(), (*object)->type) > 0;
  });
  for (const ObjectPtr& object : added) set_property(*viewed, "", object);
  return viewed;
}

Surroundings surroundings(const SceneView& view, const SceneParts& parts, const CameraSettings& camera,
                          const Orientation& orientation, bool weak_lights, const SourceLocation& where) {
  Surroundings result;
  const Bounds3 bounds = bounds_of(parts);
  std::string kind = view.environment;
  if (kind == "none" || bounds.empty()) return result;
  const Vec3& up = orientation.up;
  const Vec3 front = level(camera.to_world.vector({0, 0, -1}), up, orientation.front);
  if (kind == "auto") {
    if (has_light(parts, bounds, weak_lights)) return result;
    kind = "studio";
  }
  if (kind == "studio") {
    auto light = make_object("emitter", "envmap", where, {{"to_world", turned(up, front)}});
    set_property(*light, std::string(kEmbeddedData), studio_environment());
    result.objects.push_back(light);
    if (const ObjectPtr floor = studio_floor(bounds, camera, up, front, where)) result.objects.push_back(floor);
    if (view.environment == "auto")
      result.told = fmt::format(
          "the scene has {}: it is lit by a studio{} (`environment` studio, sky, white, none or a "
          "file)",
          parts.emitters.empty() ? "no light" : "too little light of its own",
          result.objects.size() > 1 ? " with a floor" : "");
  } else if (kind == "sky") {
    result.objects.push_back(sky(up, front, where));
  } else if (kind == "white") {
    result.objects.push_back(make_object("emitter", "constant", where, {{"radiance", 1.0}}));
  } else {
    const std::string path = std::filesystem::absolute(kind).string();
    if (std::error_code ignored; !std::filesystem::exists(path, ignored))
      throw Error(ErrorCode::kInput, fmt::format("`environment` '{}': there is no such file", kind) +
                                         hint_and_list(kind, {"studio", "sky", "white", "none"},
                                                       "expected a file, studio, sky, white or none"));
    result.objects.push_back(
        make_object("emitter", "envmap", where, {{"filename", path}, {"to_world", turned(up, orientation.front)}}));
  }
  return result;
}

}  // namespace covary
