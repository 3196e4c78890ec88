// SPDX-License-Identifier: Apache-2.0
// Written by benchmarks/error_intervals/fit.py: the coefficients of error_interval.h, without a network and with one.
#pragma once

#include "risk/error_interval.h"

namespace covary {

struct FittedErrors {
  ErrorFeatures middle, log_spread;          ///< a, b
  double least_log_spread, most_log_spread;  ///< of the renders that were fitted
  double low, high;                          ///< quantiles of r
};

// clang-format off
inline constexpr FittedErrors kFittedErrors[] = {
    {{0.365, 0.09308, 0.06775, -0.06235, 0.06971, 0.03119, 0.1211, 0.004849, 0.01772, 0.2273},
     {-0.2297, 0, -0.09452, 0, 0, 0, -0.1744, -0.1656, -0.2919, 0},
     -2.384, -1.527, -0.867, 1.681},
    {{0.4987, 0.07706, -0.08913, -0.06182, 0.07972, 0.01712, 0.04478, 0.02886, 0.02496, 0.0357},
     {-1.942, 0, 0.2966, 0, 0, 0, -0.073, -0.03086, 0.3404, 0},
     -2.113, -1.477, -1.352, 1.656},
};
// clang-format on

/// Where the largest group of each pixel has a larger share of the light, the bounds are further off than this factor,
/// or fewer pixels hold the noise, as a number or as a fraction of all, there is no interval.
inline constexpr double kMostOfLargest = 0.6, kMostFactor = 5;
inline constexpr double kFewestPixels = 20, kFewestOfPixels = 0.02;

}  // namespace covary
