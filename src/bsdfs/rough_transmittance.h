// SPDX-License-Identifier: Apache-2.0
// What a rough dielectric interface transmits and reflects, for models with a coat. Tabulated by quadrature over the
// visible normals.
#pragma once

#include <array>
#include <memory>

#include "bsdfs/microfacet.h"

namespace covary {

/// Directional transmittance of a rough dielectric interface from outside, and its mean reflectance from inside.
class RoughTransmittance {
 public:
  RoughTransmittance(const Microfacet& normals, float eta);
  /// `cos_theta` in [0, 1].
  float operator()(float cos_theta) const {
    const float x = cos_theta * (kSize - 1);
    const int i = std::min(static_cast<int>(x), kSize - 2);
    return lerp(x - static_cast<float>(i), external_[i], external_[i + 1]);
  }
  float internal_reflectance() const { return internal_reflectance_; }

 private:
  static constexpr int kSize = 64;

  std::array<float, kSize> external_;
  float internal_reflectance_;
};

/// The table of an interface, shared while any user is alive. `eta`: relative index, not 1. Thread-safe.
std::shared_ptr<const RoughTransmittance> shared_transmittance(const Microfacet& normals, float eta);

}  // namespace covary
