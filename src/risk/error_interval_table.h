// SPDX-License-Identifier: Apache-2.0
// Written by benchmarks/error_intervals/fit.py: the coefficients of error_interval.h for each ErrorKind.
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
    {{-0.371, 0, -0.246, 0, -0.01546, 0.009935, 0.02923, 0.03973, -0.0216},
     {-1.18, 0, 0.5608, 0, 0, -0.3587, -0.1113, 0.1006, 0},
     -2.739, -2.151, -1.802, 2.467},
    {{-0.2855, 0.5225, 0.09059, 0.1967, 0.05807, 0.09671, -0.005651, 0.06231, -0.129},
     {-2.329, 0, 0.5071, 0, 0, 0.6066, -0.09816, 0.01842, 0},
     -2.314, -1.366, -2.022, 3.263},
    {{0.8469, 0.07595, 0.4437, 0.05793, 0.07572, 0.05631, -0.00884, -0.01371, 0.1212},
     {-2.511, 0, 0.2407, 0, 0, -0.0196, 0.04966, 0.1009, 0},
     -2.187, -1.914, -3.637, 2.444},
    {{0.578, 0.2611, 0.03219, 0.131, 0.04947, 0.163, -0.03166, -0.04846, 0.08365},
     {-2.015, 0, 0.4864, 0, 0, 0.3761, -0.06283, 0.4779, 0},
     -1.977, -0.4759, -1.317, 3.542},
    {{-0.1193, 0.1795, 0.1048, 0.1489, 0.05252, 0.1525, -0.01485, 0.105, 0.08956},
     {-2.684, 0, 1.029, 0, 0, 0.5487, -0.09725, 0.3263, 0},
     -2.441, -0.8842, -2.108, 2.168},
    {{0.1786, 0.03396, 0.02518, 0.09263, 0.02311, 0.2086, -0.004093, 0.05315, -0.07197},
     {-2.114, 0, 0.1565, 0, 0, 0.3447, -0.09549, 0.4649, 0},
     -2.2, -0.95, -4.624, 1.997},
};
// clang-format on

/// There is no interval where the largest group of each pixel has a larger share of the light, the bounds are further
/// off than this factor, fewer pixels hold the noise, as a number or as a fraction of all, or there are fewer groups.
inline constexpr double kMostOfLargest = 0.6, kMostFactor = 5;
inline constexpr double kFewestPixels = 20, kFewestOfPixels = 0.04;
inline constexpr int kFewestGroups = 8;

}  // namespace covary
