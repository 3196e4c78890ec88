// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/spectrum.h"
#include "scene/texture.h"

namespace covary {

/// f = reflectance / pi.
struct Lambertian {
  Spectrum reflectance;              ///< at all points, if there is no texture
  const Texture* texture = nullptr;  ///< of the reflectance, or null
  bool both_sides = false;           ///< otherwise black for directions below the shading normal
};

/// Mixin of BSDFs that may be purely Lambertian. Integrators shade such surfaces many at a time.
class MaybeLambertian {
 public:
  /// Null if the model is not purely Lambertian.
  virtual const Lambertian* lambertian() const = 0;

 protected:
  ~MaybeLambertian() = default;
};

/// Same for any model; null if it is not known to be Lambertian.
inline const Lambertian* lambertian_of(const auto& bsdf) {
  const auto* maybe = dynamic_cast<const MaybeLambertian*>(&bsdf);
  return maybe ? maybe->lambertian() : nullptr;
}

}  // namespace covary
