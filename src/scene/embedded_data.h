// SPDX-License-Identifier: Apache-2.0
// Files embedded in a scene's own file: the property `data` of a mesh or image holds the bytes of a file instead of its
// name, `filename`.
#pragma once

#include <string>
#include <string_view>

#include "scene/parameters.h"

namespace covary {

inline constexpr std::string_view kEmbeddedData = "data";

/// The embedded bytes of a mesh (PLY) or image; null if the object names a file. They live as long as its description.
inline const std::string* find_embedded(Parameters& parameters) {
  const std::string name(kEmbeddedData);
  for (const Property& property : parameters.object().properties)
    if (property.name == name) {
      parameters.get_string(name, "");  // marks it as known; an error if it is not a string
      return std::get_if<std::string>(&property.value);
    }
  return nullptr;
}

}  // namespace covary
