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
    {{0.6233, 0.001431, 0.08913, 0.0006518, 0.0356, 0.02632, 0.06433, -0.006767, 0.006442, 0.137},
     {-0.4914, 0, -0.3596, 0, 0, 0, -0.3182, -0.08623, 0.1609, 0},
     -1.863, -1.18, -0.7704, 1.377},
    {{0.5183, -0.08252, -0.0106, -0.008119, 0.03825, 0.001952, 0.03545, 0.01812, -0.0337, 0.1079},
     {-1.817, 0, 0.3538, 0, 0, 0, 0.1684, -0.06648, 0.07457, 0},
     -2.022, -1.234, -1.2, 1.467},
};
// clang-format on

/// Where the largest group of each pixel has a larger share of the light, the bounds are further off than this factor,
/// or fewer pixels hold the noise, there is no interval.
inline constexpr double kMostOfLargest = 0.6, kMostFactor = 5, kFewestPixels = 20;

}  // namespace covary
