// SPDX-License-Identifier: Apache-2.0
#include "filters/norm.h"

#include <cmath>

namespace covary {

float length(Norm norm, const Spectrum& colour) {
  if (norm == Norm::kL1) return std::abs(colour.r) + std::abs(colour.g) + std::abs(colour.b);
  return std::sqrt(colour.r * colour.r + colour.g * colour.g + colour.b * colour.b);
}

float scalar_variance(Norm norm, const Spectrum& variance) {
  if (norm == Norm::kL2) return variance.r + variance.g + variance.b;
  const float sum = std::sqrt(variance.r) + std::sqrt(variance.g) + std::sqrt(variance.b);
  return sum * sum;
}

}  // namespace covary
