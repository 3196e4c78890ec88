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
    {{0.6393, 0.07659, 0.05696, 0.02551, 0.03105, 0.03416, -0.001645, 0.03598, 0.2551},
     {-0.8777, 0, 0.2484, 0, 0, -0.05503, -0.0598, 0.03611, 0},
     -1.491, -0.9039, -0.837, 1.044},
    {{0.9623, 0.02686, 0.0522, 0.01619, 0.03964, 0.04826, -0.01835, 0.07557, 0.07772},
     {-0.7789, 0, 0.4002, 0, 0, -0.1022, -0.06217, 0.0922, 0},
     -1.462, -0.6722, -1.968, 0.6543},
    {{0.2181, 0.3441, -0.1731, 0.1004, 0.01988, -0.1247, 0.001204, 0.2344, 0.05583},
     {-1.644, 0, 0.6713, 0, 0, 0.1405, -0.1093, 0.3365, 0},
     -2.135, -0.4532, -3.222, 1.513},
    {{0.02516, -0.0641, -0.1132, 0.02843, 0.003798, 0.2265, 0.007172, 0.1548, 0.07447},
     {0.2584, 0, 0.1523, 0, 0, -0.01013, -0.2699, -0.08718, 0},
     -2.202, -0.5723, -3.824, 0.9705},
};
/// Of denoised means of fewer groups than kFewestGroups: by filters, by a network.
inline constexpr FittedErrors kFittedToFew[] = {
    {{-1.954, -0.4407, -0.7959, 0.3261, -0.09035, 0.3141, 0.1719, 0.3358, 0.3617},
     {1.281, 0, -1.412, 0, 0, -0.4169, -0.2926, -0.1884, 0},
     -1.705, 0.1267, -1.913, 1.571},
    {{1.134, -0.02603, -0.3729, 0.01022, 0.06325, 0.09881, -0.006214, -0.03288, -0.03951},
     {-0.9236, 0, 0.9313, 0, 0, -0.2737, -0.06821, 0.02666, 0},
     -1.659, -0.6109, -2.653, 1.771},
};
// clang-format on

/// There is no interval where the largest group of each pixel has a larger share of the light that is not common to all
/// groups, the bounds are further off than this factor, a larger share of the noise is in mirrors or behind glass,
/// fewer pixels hold the noise, or there are fewer groups and the kind has no fit for few.
inline constexpr double kMostOfLargest = 0.55, kMostFactor = 5, kMostSpecular = 0.5;
inline constexpr int kFewestPixels = 20, kFewestGroups = 8;

}  // namespace covary
