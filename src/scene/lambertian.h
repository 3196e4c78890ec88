// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/spectrum.h"
#include "scene/texture.h"

namespace covary {

/// f = reflectance / pi.
struct Lambertian {
  Spectrum reflectance;              ///< of all points, where there is no texture
  const Texture* texture = nullptr;  ///< of the reflectance, or null
  bool both_sides = false;           ///< else black for directions below the shading normal
};

/// What a Bsdf is, too, that may be no more than that. Integrators shade such surfaces many at a time.
class MaybeLambertian {
 public:
  /// Null where it is more.
  virtual const Lambertian* lambertian() const = 0;

 protected:
  ~MaybeLambertian() = default;
};

/// Of any model; null where it is not known to be one.
inline const Lambertian* lambertian_of(const auto& bsdf) {
  const auto* maybe = dynamic_cast<const MaybeLambertian*>(&bsdf);
  return maybe ? maybe->lambertian() : nullptr;
}

}  // namespace covary
