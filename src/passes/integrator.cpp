// SPDX-License-Identifier: Apache-2.0
#include "passes/integrator.h"

#include "core/error.h"

namespace covary {

void require_sees_media(const Integrator& integrator, const Scene& scene) {
  if (!scene.has_media() || integrator.sees_media()) return;
  const std::string text = integrator.description();
  throw Error(ErrorCode::kInput, scene.first_medium() + ": the integrator '" + text.substr(0, text.find(' ')) +
                                     "' does not see participating media; 'path' does");
}

}  // namespace covary
