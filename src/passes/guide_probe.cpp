// SPDX-License-Identifier: Apache-2.0
#include "passes/guide_probe.h"

#include "core/trigonometry.h"

namespace covary {

Vec3 probe_direction(float x, float y) {
  const SinCos polar = sincos_turns(0.5f * y), turn = sincos_turns(x);
  return {polar.sin * turn.cos, polar.cos, polar.sin * turn.sin};
}

}  // namespace covary
