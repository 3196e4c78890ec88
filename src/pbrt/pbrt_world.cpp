// SPDX-License-Identifier: Apache-2.0
#include "pbrt/pbrt_world.h"

#include <fmt/format.h>

#include <algorithm>

namespace covary {
namespace {

constexpr size_t kMaxObjects = 1000000;  // far above what scenes need

bool is_opaque(const Value& alpha) { return std::holds_alternative<double>(alpha) && std::get<double>(alpha) >= 1; }
bool is_invisible(const Value& alpha) { return std::holds_alternative<double>(alpha) && std::get<double>(alpha) <= 0; }

}  // namespace

void PbrtWorld::add(const ObjectPtr& object) {
  if (++n_objects_ > kMaxObjects) {
    messages_.error(object->where, fmt::format("more than {} objects", kMaxObjects));
    throw PbrtStop();
  }
  set_property(*scene_, "", object);
}

void PbrtWorld::shape(const std::string& type, PbrtParameters& p, const PbrtState& state) {
  const auto alpha = float_value(p, "alpha", 1, names_);
  p.ignore({"shadowalpha"});  // version 3
  const std::string emission = p.get_string("emissionfilename", "");
  const auto [shape, uv] = make_pbrt_shape(type, p, state.placement, names_.files());
  if (!emission.empty()) p.warn("has an 'emissionfilename', which is left out: its light is the same everywhere");
  if (!shape || !alpha) {
    p.ignore_all();
    return;
  }
  p.report_unknown(names_.version_3);
  if (is_invisible(*alpha) && !state.area_light) return;  // pbrt's rays do not meet it
  Pending made{shape, uv, *alpha, state.material, state.inside, state.outside, state.area_light, group_ != nullptr};
  if (type == "curve" && join_curves(made)) return;
  if (group_ && made.light) p.warn("emits no light, because it is part of an object that has instances");
  if (group_) made.light = nullptr;
  auto& list = group_ ? group_->shapes : pending_;
  list.push_back(made);
  curves_ = type == "curve" && is_opaque(*alpha) && !made.light ? &list.back() : nullptr;
  if (group_) {
    if (++n_objects_ > kMaxObjects) add(shape);  // throws
    group_->has_media |= made.inside || made.outside;
    set_property(*group_->object, "", ObjectPtr(shape));
  } else {
    add(shape);
  }
}

bool PbrtWorld::join_curves(const Pending& shape) {
  return curves_ && is_opaque(shape.alpha) && !shape.light && curves_->material == shape.material &&
         curves_->inside == shape.inside && curves_->outside == shape.outside && curves_->in_group == shape.in_group &&
         join_pbrt_curves(*curves_->shape, *shape.shape);
}

void PbrtWorld::light(const std::string& type, PbrtParameters p, const Transform& to_world) {
  const auto place = make_object("emitter", "", p.where());
  add(place);
  lights_.push_back({type, std::move(p), to_world, place});
}

void PbrtWorld::begin_object(const std::string& name, const SourceLocation& where) {
  if (group_) messages_.error(where, "an object inside an object");
  const auto [place, is_new] = groups_.emplace(name, Group());
  if (!is_new) {
    messages_.warn(where, fmt::format("a second object has the name '{}'; it replaces the first from here on", name));
    place->second = Group();
  }
  group_ = &place->second;
  group_->object = make_object("shape", "shapegroup", where);
  group_->object->id = name;
  curves_ = nullptr;
}

bool PbrtWorld::end_object() {
  if (!group_) return false;
  curves_ = nullptr;
  // Shapes of groups cannot have media: copies of those stand in the scene, one for each instance.
  if (!group_->has_media && !group_->shapes.empty()) {
    pending_.insert(pending_.end(), group_->shapes.begin(), group_->shapes.end());
    add(group_->object);
  }
  group_ = nullptr;
  return true;
}

void PbrtWorld::place_instance(const std::string& name, const Transform& to_world, const SourceLocation& where) {
  const auto found = groups_.find(name);
  if (found == groups_.end() || &found->second == group_) {
    messages_.error(where, fmt::format("no object before this one has the name '{}'", name));
    return;
  }
  if (group_) {
    messages_.error(where, "an instance inside an object is not supported");
    return;
  }
  const Group& group = found->second;
  if (group.shapes.empty()) return;
  if (!group.has_media) {
    add(make_object("shape", "instance", where, {{"to_world", to_world}, {"", ObjectPtr(group.object)}}));
    return;
  }
  for (Pending copy : group.shapes) {
    auto shape = std::make_shared<ObjectDescription>(*copy.shape);
    Transform own;
    for (const Property& property : shape->properties)
      if (const Transform* given = std::get_if<Transform>(&property.value); given && property.name == "to_world")
        own = *given;
    std::erase_if(shape->properties, [](const Property& p) { return p.name == "to_world"; });
    set_property(*shape, "to_world", to_world * own);
    copy.shape = shape, copy.in_group = false;
    pending_.push_back(copy);
    add(shape);
  }
  curves_ = nullptr;
}

ObjectPtr PbrtWorld::find(PbrtKind kind, const PbrtUsePtr& use, bool& failed) {
  if (!use) return nullptr;
  PbrtDefinitionPtr definition = use->own ? use->own : names_.find(kind, use->name, use->order);
  const char* what = kind == PbrtKind::kMaterial ? "material" : "medium";
  if (!definition) {
    // Version 3 goes on without it.
    const bool lenient = names_.version_3 && kind == PbrtKind::kMaterial;
    failed = !lenient;
    if (lenient)
      messages_.warn(use->where, fmt::format("no material has the name '{}'; pbrt's default is taken", use->name));
    else if (reported_.insert(what + use->name).second)  // one message for each name
      messages_.error(use->where, fmt::format("no {} has the name '{}'{}", what, use->name,
                                              did_you_mean(use->name, names_.known(kind))));
    return nullptr;
  }
  ObjectPtr object = names_.make(*definition);
  failed |= !object;
  return object;
}

ObjectPtr PbrtWorld::area_light(PbrtAreaLight& light, const PbrtView& view) {
  if (!light.made) {
    light.light = make_pbrt_area_light(light.type, light.parameters, view, names_);
    light.parameters.report_unknown(names_.version_3);
  }
  light.made = true;
  return light.light;
}

bool PbrtWorld::is_bare_light(const ObjectPtr& material, const Pending& shape) {
  const bool bare = names_.version_3 && shape.light && material && material->type == "null" && !shape.inside &&
                    !shape.outside && is_opaque(shape.alpha);
  if (bare)
    messages_.warn(shape.shape->where, "a light without a material is opaque, as for the light rays of version 3");
  return bare;
}

void PbrtWorld::finish_shape(const Pending& pending, const PbrtView& view) {
  bool failed = false;
  const ObjectPtr material = find(PbrtKind::kMaterial, pending.material, failed);
  ObjectDescription& shape = *pending.shape;
  if (!failed && is_bare_light(material, pending))
    set_property(shape, "", ObjectPtr(make_object("bsdf", "diffuse", shape.where, {{"reflectance", 0.0}})));
  else if (!failed)
    set_property(shape, "", surfaces_.make(material, pending.alpha, pending.uv, shape.where));
  const bool with_media = !view.without_media;
  for (const auto& [side, use] : {std::pair{"interior", pending.inside}, {"exterior", pending.outside}}) {
    media_left_out_ |= use && !with_media;
    if (const ObjectPtr medium = with_media ? find(PbrtKind::kMedium, use, failed) : nullptr)
      set_property(shape, side, medium);
  }
  if (!pending.light) return;
  if (const ObjectPtr light = area_light(*pending.light, view))
    set_property(shape, "", surfaces_.fit(PbrtSurfaces::masked_light(light, pending.alpha, shape), pending.uv));
}

void PbrtWorld::finish_lights(const PbrtView& view) {
  ObjectBuilder sky;  // several lights of constant radiance from everywhere are one
  Spectrum sum;
  for (Light& light : lights_) {
    const ObjectPtr object = make_pbrt_light(light.type, light.parameters, light.to_world, view, names_);
    if (!object) continue;
    light.parameters.report_unknown(names_.version_3);
    if (object->type == "constant") {
      for (const Property& property : object->properties)
        if (const auto* radiance = std::get_if<ColourValue>(&property.value)) sum = sum + radiance->rgb;
      if (sky) continue;
      sky = light.place;
    }
    *light.place = *object;
  }
  if (sky) {
    sky->properties.clear();
    set_property(*sky, "radiance", ColourValue{sum});
    if (max_component(sum) == 0) sky->type.clear();
  }
  std::erase_if(scene_->properties, [](const Property& property) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    return object && (*object)->kind == "emitter" && (*object)->type.empty();
  });
  join_skies();
}

void PbrtWorld::join_skies() {
  std::vector<Property> skies;
  for (const Property& property : scene_->properties) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    if (object && (*object)->kind == "emitter" && ((*object)->type == "constant" || (*object)->type == "envmap"))
      skies.push_back(property);
  }
  if (skies.size() < 2) return;
  const auto sum = make_object("emitter", "environments", skies[0].where);
  sum->properties = skies;
  const auto is_sky = [&](const Property& property) {
    const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
    return object &&
           std::ranges::any_of(skies, [&](const Property& s) { return std::get<ObjectPtr>(s.value) == *object; });
  };
  std::erase_if(scene_->properties, is_sky);
  set_property(*scene_, "", ObjectPtr(sum));
}

void PbrtWorld::finish(const PbrtView& view) {
  names_.exposure = view.exposure();
  for (const Pending& shape : pending_) finish_shape(shape, view);
  finish_lights(view);
  if (const auto& [sensor, use] = camera_; sensor && use) {
    bool failed = false;
    media_left_out_ |= view.without_media;
    if (const ObjectPtr medium = view.without_media ? nullptr : find(PbrtKind::kMedium, use, failed))
      set_property(*sensor, "", medium);
  }
  if (media_left_out_)  // as some integrators of pbrt do
    messages_.warn(view.integrator ? view.integrator->where : scene_->where,
                   "this integrator of pbrt leaves media out: so do we; 'volpath' has them");
  names_.check_unused();
}

}  // namespace covary
