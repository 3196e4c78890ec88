// SPDX-License-Identifier: Apache-2.0
#include "formats/object_builder.h"

namespace covary {

ObjectBuilder make_object(const std::string& kind, const std::string& type, const SourceLocation& where) {
  auto object = std::make_shared<ObjectDescription>();
  object->kind = kind, object->type = type, object->where = where;
  return object;
}

void set_property(ObjectDescription& object, const std::string& name, Value value) {
  if (const Transform* transform = std::get_if<Transform>(&value)) {
    try {
      value = Transform(transform->matrix()) * Transform();  // as of <matrix> in XML
    } catch (const Error&) {                                 // scaled by so little that it looks singular
    }
  }
  object.properties.push_back({name, std::move(value), object.where});
}

}  // namespace covary
