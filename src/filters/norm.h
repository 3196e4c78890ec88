// SPDX-License-Identifier: Apache-2.0
// The norms of colours in dependent tests [Csonka2002].
#pragma once

#include <cmath>

#include "core/spectrum.h"

namespace covary {

/// Of a colour or of a difference of colours.
enum class Norm {
  kSum,        ///< of absolute channel values, as [Csonka2002] suggests at the end of Sec. 4
  kEuclidean,  ///< in which the variance of a sample, Sec. 5, is the sum of the channels' variances
};

inline float colour_length(const Spectrum& colour, Norm norm = Norm::kSum) {
  if (norm == Norm::kEuclidean) return std::sqrt(colour.r * colour.r + colour.g * colour.g + colour.b * colour.b);
  return std::abs(colour.r) + std::abs(colour.g) + std::abs(colour.b);
}

}  // namespace covary
