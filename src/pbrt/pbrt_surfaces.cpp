// SPDX-License-Identifier: Apache-2.0
#include "pbrt/pbrt_surfaces.h"

#include <algorithm>

namespace covary {
namespace {

/// From our texture coordinates to pbrt's (shapes.h), for each shape.
Transform to_pbrt(PbrtUv uv) {
  const auto map = [](double uu, double uw, double u0, double vu, double vv, double v0) {
    return Transform(Matrix4{{{uu, uw, 0, u0}, {vu, vv, 0, v0}, {0, 0, 1, 0}, {0, 0, 0, 1}}});
  };
  switch (uv) {
    case PbrtUv::kSphere:  // v grows with z
      return map(1, 0, 0, 0, -1, 1);
    case PbrtUv::kDisk:  // (angle / 2 pi, 1 - r) of (r, angle / 2 pi)
      return map(0, 1, 0, -1, 0, 1);
    // The corners are (0, 0), (1, 0), (1, 1), and (0, 0), (1, 0), (0, 1) of the triangle as it is stored here, in which
    // mirroring exchanges the first corner and the last, flipped normals then the second and the last.
    case PbrtUv::kTriangles:
      return map(1, 1, 0, 0, 1, 0);
    case PbrtUv::kMirroredTriangles:
      return map(0, -1, 1, -1, -1, 1);
    case PbrtUv::kFlippedTriangles:
      return map(1, 1, 0, 1, 0, 0);
    case PbrtUv::kMirroredFlippedTriangles:
      return map(-1, 0, 1, -1, -1, 1);
    case PbrtUv::kOwn:
    case PbrtUv::kCurve:
      break;
  }
  return {};
}

bool has_coordinates(const ObjectDescription& object) {
  return object.kind == "texture" &&
         std::ranges::any_of(object.properties, [](const Property& p) { return p.name == "to_uv"; });
}

template <typename Is>
bool contains(const ObjectPtr& root, const Is& is) {
  bool found = is(*root);
  visit_properties(*root, [&](const ObjectDescription&, const Property& property) {
    const ObjectPtr* child = std::get_if<ObjectPtr>(&property.value);
    found |= child && *child && is(**child);
  });
  return found;
}

Property* find(ObjectDescription& object, const std::string& name) {
  const auto found = std::ranges::find_if(object.properties, [&](const Property& p) { return p.name == name; });
  return found == object.properties.end() ? nullptr : &*found;
}

}  // namespace

ObjectPtr PbrtSurfaces::make(const ObjectPtr& material, const Value& alpha, PbrtUv uv, const SourceLocation& where) {
  ObjectPtr whole = material ? material : default_material(where);
  if (const auto* number = std::get_if<double>(&alpha); !number || *number < 1) {
    auto mask = make_object("bsdf", "mask", where, {{"opacity", alpha}, {"", whole}});
    whole = mask;
  }
  if (uv == PbrtUv::kCurve) {
    if (contains(whole, has_coordinates))
      messages_.warn(where, "textures of curves lie differently around them than in pbrt");
    return whole;
  }
  if (uv == PbrtUv::kDisk && contains(whole, [](const ObjectDescription& o) { return o.type == "normalmap"; }))
    messages_.warn(where, "the normals of a normal map are turned by a quarter around the axis of a disk");
  return fit(whole, uv);
}

// lights.cpp: DiffuseAreaLight.
ObjectPtr PbrtSurfaces::masked_light(const ObjectPtr& light, const Value& alpha, ObjectDescription& shape) {
  const auto* number = std::get_if<double>(&alpha);
  if (number && *number >= 1) return light;
  auto copy = std::make_shared<ObjectDescription>(*light);
  if (number && *number <= 0) {
    set_property(*copy, "hidden", true);
    if (shape.type == "sphere" && find(*copy, "two_sided")) {
      std::erase_if(copy->properties, [](const Property& p) { return p.name == "two_sided"; });
      std::erase_if(shape.properties, [](const Property& p) { return p.name == "flip_normals"; });
    }
  } else {
    Value& radiance = find(*copy, "radiance")->value;
    const ObjectPtr* texture = std::get_if<ObjectPtr>(&radiance);
    const ObjectPtr whole = texture ? *texture : make_object("texture", "uniform", light->where, {{"value", radiance}});
    radiance = ObjectPtr(scaled_texture(light->where, alpha, whole));
  }
  return copy;
}

ObjectPtr PbrtSurfaces::default_material(const SourceLocation& where) {
  if (!default_)
    default_ = make_object("bsdf", "twosided", where, {{"", ObjectPtr(make_object("bsdf", "diffuse", where))}});
  return default_;
}

ObjectPtr PbrtSurfaces::fit(const ObjectPtr& object, PbrtUv uv) {
  if (uv == PbrtUv::kOwn || uv == PbrtUv::kCurve || object->type == "projected") return object;  // not by (u, v)
  if (const auto known = fitted_.find({object, uv}); known != fitted_.end()) return known->second;
  auto copy = std::make_shared<ObjectDescription>(*object);
  bool changed = false;
  for (Property& property : copy->properties)
    if (ObjectPtr* child = std::get_if<ObjectPtr>(&property.value); child && *child) {
      const ObjectPtr fitted = fit(*child, uv);
      changed |= fitted != *child;
      *child = fitted;
    }
  if (has_coordinates(*copy)) {
    Property* to_uv = find(*copy, "to_uv");
    const Transform before = to_uv ? std::get<Transform>(to_uv->value) : Transform();
    std::erase_if(copy->properties, [](const Property& p) { return p.name == "to_uv"; });
    set_property(*copy, "to_uv", before * to_pbrt(uv));
    changed = true;
  }
  // Our u runs along the radius of a disk, pbrt's around its centre.
  if (Property* u = find(*copy, "alpha_u"), *v = find(*copy, "alpha_v"); uv == PbrtUv::kDisk && u && v) {
    std::swap(u->value, v->value);
    changed = true;
  }
  return fitted_[{object, uv}] = changed ? ObjectPtr(copy) : object;
}

}  // namespace covary
