// SPDX-License-Identifier: Apache-2.0
#include "emitters/rotation.h"

#include "core/error.h"

namespace covary {

Rotation::Rotation(const Transform& t) : x_(t.vector({1, 0, 0})), y_(t.vector({0, 1, 0})), z_(t.vector({0, 0, 1})) {
  const float lx = length(x_), ly = length(y_), lz = length(z_);
  const float longest = std::max(lx, std::max(ly, lz)), shortest = std::min(lx, std::min(ly, lz));
  constexpr float kDigits = 1e-3f, kTolerance = 0.02f;
  const float skew = std::max(std::abs(dot(x_, y_)), std::max(std::abs(dot(y_, z_)), std::abs(dot(z_, x_))));
  const auto within = [&](float tolerance) {
    return longest - shortest <= tolerance * longest && skew <= tolerance * longest * longest;
  };
  is_nearest_ = !within(kDigits);
  if (!within(kTolerance))
    throw Error(ErrorCode::kInput,
                "distorts directions; only rotations, reflections, translations and uniform scales "
                "are accepted here");
  // Matrices in files have few digits: orthonormalise, so that densities stay correct.
  x_ = normalize(x_);
  y_ = normalize(y_ - x_ * dot(x_, y_));
  const Vec3 z = cross(x_, y_);
  z_ = dot(z, z_) < 0 ? -z : z;
}

}  // namespace covary
