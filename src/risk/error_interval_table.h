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
    {{-0.04385, 0, -0.04563, 0, -0.02177, -0.006935, -0.003442, -0.002705, -0.008631},
     {-0.7953, 0, 0.1093, 0, 0, -0.6254, -0.044, -0.1897, 0},
     -2.767, -1.731, -1.066, 1.066},
    {{0.4359, 0.3219, 0.1323, 0.01287, 0.02026, -0.02566, -0.02702, 0.005946, 0.06114},
     {-1.718, 0, 0.4775, 0, 0, 0.05616, -0.08059, 0.2772, 0},
     -2.197, -0.9505, -1.488, 2.514},
    {{0.5831, 0.08909, 0.2379, 0.04017, 0.0425, -0.01553, -0.01391, 0.1634, 0.4521},
     {-0.1542, 0, -0.3209, 0, 0, -0.3355, -0.1154, 0.09181, 0},
     -1.868, -1.103, -1.763, 1.032},
    {{0.9818, 0.05156, -0.0437, 0.02739, 0.09475, 0.04169, -0.01427, 0.1028, 0.1765},
     {0.03226, 0, 0.4297, 0, 0, -0.5218, -0.1072, 0.2378, 0},
     -1.764, -0.6274, -2.116, 0.9962},
    {{0.2187, 0.343, -0.1704, 0.1008, 0.01966, -0.1252, 0.0006179, 0.2334, 0.06365},
     {-1.622, 0, 0.6744, 0, 0, 0.1338, -0.1104, 0.3318, 0},
     -2.134, -0.4565, -3.224, 1.511},
    {{0.02055, -0.05694, -0.1154, 0.02738, 0.0004624, 0.2185, 0.008234, 0.144, 0.0902},
     {0.2285, 0, 0.1553, 0, 0, -0.01114, -0.2621, -0.1113, 0},
     -2.211, -0.5949, -4.312, 0.7437},
};
/// Of denoised means of fewer groups than kFewestGroups: by filters, by a network.
inline constexpr FittedErrors kFittedToFew[] = {
    {{-1.113, -0.2796, -0.9446, 0.3549, -0.07041, 0.07521, 0.08391, 0.09057, 0.6128},
     {0.6038, 0, -1.506, 0, 0, -0.1969, -0.2522, 0.329, 0},
     -1.644, -0.3248, -1.823, 1.162},
    {{0.893, -0.06814, -0.2382, -0.008801, 0.02945, 0.1082, 0.003068, 0.1075, 0.1328},
     {-0.5919, 0, 0.3186, 0, 0, -0.215, -0.1097, 0.2168, 0},
     -1.593, -0.8402, -2.603, 1.161},
};
// clang-format on

/// There is no interval where the largest group of each pixel has a larger share of the light that is not common to all
/// groups, the bounds are further off than this factor, a larger share of the noise is in mirrors or behind glass,
/// fewer pixels hold the noise, or there are fewer groups and the kind has no fit for few.
inline constexpr double kMostOfLargest = 0.55, kMostFactor = 5, kMostSpecular = 0.5;
inline constexpr int kFewestPixels = 20, kFewestGroups = 8;

}  // namespace covary
