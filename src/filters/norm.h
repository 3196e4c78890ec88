// SPDX-License-Identifier: Apache-2.0
// One number for three channels, as dependent tests [Csonka2002] need it.
#pragma once

#include <utility>

#include "core/spectrum.h"

namespace covary {

/// Length of a difference of colours; the same for differences, standard deviations and brightness.
enum class Norm {
  kL1,  ///< sum of the absolute values of the channels, [Csonka2002] end of Sec. 4
  kL2,  ///< Euclidean
};

inline constexpr std::pair<const char*, Norm> kNorms[] = {{"l1", Norm::kL1}, {"l2", Norm::kL2}};
inline constexpr const char* kNormHelp = "Norm of colours: sum of absolute values, or Euclidean";

float length(Norm norm, const Spectrum& colour);
/// Variance of one sample as a scalar. Euclidean: the sum of the channels' variances, exact. Sum of absolute values:
/// (sum of the channels' standard deviations)^2, the most that it can be, and exact where channels vary in proportion.
float scalar_variance(Norm norm, const Spectrum& variance);

}  // namespace covary
