// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "scene/texture.h"

namespace covary {

/// Texture::grad_1() by differences, for textures whose coordinates are not (u, v): the point moves along the surface.
inline Vec2 difference_gradient(const Texture& texture, const SurfaceHit& hit) {
  constexpr float kStep = 1 / 2048.0f;
  const float here = texture.eval_1(hit);
  SurfaceHit moved = hit;
  moved.p = hit.p + hit.dp_du * kStep, moved.uv = {hit.uv.x + kStep, hit.uv.y};
  const float along_u = texture.eval_1(moved);
  moved.p = hit.p + hit.dp_dv * kStep, moved.uv = {hit.uv.x, hit.uv.y + kStep};
  return {(along_u - here) / kStep, (texture.eval_1(moved) - here) / kStep};
}

}  // namespace covary
