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
    {{-0.3353, 0, -0.7938, 0, -0.02473, 0.03925, 0.00947, 0.06513, 0.03342},
     {-1.866, 0, 3.532, 0, 0, -0.1459, -0.07884, 0.123, 0},
     -2.726, -1.451, -1.579, 1.579},
    {{0.4359, 0.3219, 0.1323, 0.01287, 0.02026, -0.02566, -0.02702, 0.005946, 0.06114},
     {-1.718, 0, 0.4775, 0, 0, 0.05616, -0.08059, 0.2772, 0},
     -2.197, -0.9505, -1.488, 2.514},
    {{0.4254, 0.087, 0.2468, 0.06546, 0.03974, -0.01261, -0.01076, 0.1728, 0.4224},
     {-0.181, 0, -0.259, 0, 0, -0.3518, -0.1261, 0.1659, 0},
     -1.863, -1.142, -2.536, 1.502},
    {{0.8567, 0.04778, -0.02895, 0.0428, 0.08362, 0.04365, -0.01597, 0.1197, 0.1704},
     {0.06455, 0, 0.4648, 0, 0, -0.526, -0.1199, 0.266, 0},
     -1.821, -0.5818, -3.247, 1.338},
    {{0.1346, 0.3338, -0.1753, 0.1169, 0.01687, -0.1291, 0.001418, 0.2419, 0.05507},
     {-1.695, 0, 0.6797, 0, 0, 0.1365, -0.1043, 0.3525, 0},
     -2.139, -0.457, -3.232, 1.512},
    {{-0.002558, -0.07072, -0.1048, 0.04668, -0.02129, 0.156, 0.01787, 0.1341, 0.06767},
     {-0.4653, 0, 0.3971, 0, 0, 0.09662, -0.2462, 0.3207, 0},
     -2.194, -0.1916, -3.546, 1.178},
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
/// groups, the bounds are further off than this factor, fewer pixels hold the noise, or there are fewer groups and the
/// kind has no fit for few.
inline constexpr double kMostOfLargest = 0.55, kMostFactor = 5;
inline constexpr int kFewestPixels = 20, kFewestGroups = 8;

}  // namespace covary
