// SPDX-License-Identifier: Apache-2.0
// Files that stand inside of a scene's own file: the property `data` of a mesh or an image has the bytes of a file in
// place of `filename`, its name.
#pragma once

#include <string>
#include <string_view>

#include "scene/parameters.h"

namespace covary {

inline constexpr std::string_view kEmbeddedData = "data";

/// The bytes of a mesh (PLY) or image in place of `filename`; null when the object names a file. They live as long as
/// its description.
inline const std::string* find_embedded(Parameters& parameters) {
  const std::string name(kEmbeddedData);
  for (const Property& property : parameters.object().properties)
    if (property.name == name) {
      parameters.get_string(name, "");  // known, or an error where it is no text
      return std::get_if<std::string>(&property.value);
    }
  return nullptr;
}

}  // namespace covary
