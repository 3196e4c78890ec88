// SPDX-License-Identifier: Apache-2.0
#include "core/equal_area.h"

#include <algorithm>
#include <cmath>

namespace covary {
namespace {

float with_sign(float magnitude, float of) { return std::copysign(magnitude, of); }

}  // namespace

Vec3 equal_area_direction(Vec2 uv) {
  const float x = 2 * uv.x - 1, y = 2 * uv.y - 1;
  const float ax = std::abs(x), ay = std::abs(y), s = ax + ay;
  const float r = std::min(s, 2 - s);
  const float phi = r > 0 ? kPi / 4 * (1 + (ay - ax) / r) : 0;
  const float z = 1 - r * r, sine = r * std::sqrt(std::max(2 - r * r, 0.0f));
  return {with_sign(sine * std::cos(phi), x), with_sign(sine * std::sin(phi), y), s <= 1 ? z : -z};
}

Vec2 equal_area_square(const Vec3& d) {
  const float ax = std::abs(d.x), ay = std::abs(d.y);
  const float r = std::sqrt(std::max(1 - std::abs(d.z), 0.0f));
  const float turn = ax == 0 && ay == 0 ? 0 : std::atan2(ay, ax) * (2 / kPi);  // of a quarter
  float y = turn * r, x = r - y;
  if (d.z < 0) {
    const float old_x = x;
    x = 1 - y, y = 1 - old_x;
  }
  return {0.5f * (1 + with_sign(x, d.x)), 0.5f * (1 + with_sign(y, d.y))};
}

}  // namespace covary
