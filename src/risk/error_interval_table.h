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
    {{-0.3144, 0, -0.8645, 0, -0.02335, 0.04538, 0.009887, 0.05095, 0.04087},
     {-1.613, 0, 3.381, 0, 0, -0.2654, -0.08775, 0.1166, 0},
     -2.772, -1.44, -1.64, 1.64},
    {{0.428, 0.3432, 0.1128, 0.01092, 0.02461, -0.02997, -0.02333, 0.01381, 0.06169},
     {-1.916, 0, 0.3889, 0, 0, 0.1041, -0.06989, 0.2237, 0},
     -2.263, -1.174, -1.456, 3.734},
    {{0.1193, 0.1219, 0.2451, 0.09521, 0.02423, 0.004686, 0.01661, 0.1405, 0.4028},
     {-1.272, 0, -0.0276, 0, 0, 0.09826, -0.04639, -0.137, 0},
     -1.744, -1.277, -2.375, 2.287},
    {{1.244, 0.04265, 0.003189, 0.06058, 0.0656, -0.02201, -0.02645, 0.002887, 0.05591},
     {-0.6745, 0, 0.4616, 0, 0, -0.4304, -0.08495, 0.6279, 0},
     -1.871, -0.3724, -2.065, 1.217},
    {{0.1246, 0.3334, -0.1976, 0.1053, 0.02856, -0.1184, 0.01347, 0.248, 0.03156},
     {-2.063, 0, 0.5521, 0, 0, 0.2577, -0.08177, 0.3433, 0},
     -2.167, -0.6015, -2.9, 1.12},
    {{0.2991, -0.0152, -0.0988, 0.02387, -0.001877, 0.1174, 0.02581, 0.07918, -0.06216},
     {-0.6107, 0, 0.5703, 0, 0, 0.1407, -0.2396, 0.1431, 0},
     -2.232, -0.3668, -3.937, 0.8924},
};
// clang-format on

/// There is no interval where the largest group of each pixel has a larger share of the light, the bounds are further
/// off than this factor, fewer pixels hold the noise, or there are fewer groups.
inline constexpr double kMostOfLargest = 0.6, kMostFactor = 5;
inline constexpr int kFewestPixels = 20, kFewestGroups = 8;

}  // namespace covary
