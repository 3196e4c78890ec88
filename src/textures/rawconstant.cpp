// SPDX-License-Identifier: Apache-2.0
// `rawconstant`: a constant number or vector, never interpreted as a colour.
//
// | parameter | type            | default  | meaning      |
// |-----------|-----------------|----------|--------------|
// | value     | float or vector | required | one or three |
#include <algorithm>

#include "textures/registry.h"

namespace covary {

std::shared_ptr<Texture> make_rawconstant(Parameters& parameters) {
  if (!parameters.has("value")) {
    parameters.error("the float or vector 'value' is missing");
    return nullptr;
  }
  const auto& properties = parameters.object().properties;
  const bool is_vector = std::any_of(properties.begin(), properties.end(), [](const Property& p) {
    return p.name == "value" && std::holds_alternative<Vec3>(p.value);
  });
  if (!is_vector) return std::make_shared<ConstantTexture>(Spectrum(parameters.get_float("value", 0)));
  const Vec3 v = parameters.get_vec3("value", {});
  return std::make_shared<ConstantTexture>(Spectrum(v.x, v.y, v.z));
}

}  // namespace covary
