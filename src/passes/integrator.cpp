// SPDX-License-Identifier: Apache-2.0
#include "passes/integrator.h"

#include "core/error.h"

namespace covary {

std::string registered_name(const Integrator& integrator) {
  const std::string text = integrator.description();
  return text.substr(0, text.find(' '));
}

void require_sees_media(const Integrator& integrator, const Scene& scene) {
  if (!scene.has_media() || integrator.sees_media()) return;
  throw Error(ErrorCode::kInput, scene.first_medium() + ": the integrator '" + registered_name(integrator) +
                                     "' does not support participating media; 'path' does");
}

}  // namespace covary
