// SPDX-License-Identifier: Apache-2.0
#include "io/shape_copies.h"

#include "core/error.h"

namespace covary {

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

}  // namespace covary
