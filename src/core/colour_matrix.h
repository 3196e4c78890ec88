// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/spectrum.h"

namespace covary {

/// A linear map of linear RGB, such as the white balance of a camera. May give negative values.
struct ColourMatrix {
  Spectrum rows[3];
  Spectrum operator*(const Spectrum& c) const {
    const auto dot = [&](const Spectrum& row) { return row.r * c.r + row.g * c.g + row.b * c.b; };
    return {dot(rows[0]), dot(rows[1]), dot(rows[2])};
  }
};

}  // namespace covary
