// SPDX-License-Identifier: Apache-2.0
// Written by benchmarks/error_intervals/fit.py: the coefficients of error_interval.h for each ErrorKind.
#pragma once

#include "risk/error_interval.h"

namespace covary {

struct FittedErrors {
  ErrorFeatures middle, log_spread;       ///< a, b
  double min_log_spread, max_log_spread;  ///< of the renders that were fitted
  double low, high;                       ///< quantiles of r
};

// clang-format off
inline constexpr FittedErrors kFittedErrors[] = {
    {{-0.04385, 0, -0.04563, 0, -0.02177, -0.006935, -0.003442, -0.002705, -0.008631},
     {-0.7953, 0, 0.1093, 0, 0, -0.6254, -0.044, -0.1897, 0},
     -2.767, -1.731, -1.066, 1.066},
    {{-1.348, 0.6626, -0.6327, 0.134, 0.003962, 0.2619, 0.05879, 0.04082, 0},
     {-1.995, 0, 0.5729, 0, 0, 0.3413, -0.03202, 0.01221, 0},
     -1.765, -0.9959, -1.614, 1.634},
    {{0.5443, 0.04919, 0.08795, 0.01903, 0.02205, 0.06193, -0.007487, 0.01259, 0.2176},
     {-0.9177, 0, 0.621, 0, 0, 0, -0.08927, -0.04293, 0},
     -1.739, -0.673, -1.571, 1.585},
    {{0.8322, 0.04786, 0.05016, 0.02153, 0.03744, 0.0366, -0.0188, 0.08012, 0.07244},
     {-1.276, 0, 0.7106, 0, 0, 0, -0.09666, 0.09364, 0},
     -2.09, -0.7453, -1.789, 0.9669},
    {{-0.01481, 0.3731, -0.1276, 0.1254, 0.005891, -0.121, 0.0002818, 0.2642, 0.1253},
     {-1.751, 0, 0.6853, 0, 0, 0.08582, -0.08585, 0.4918, 0},
     -2.039, -0.2945, -2.209, 1.646},
    {{-0.4043, -0.008423, -0.07944, 0.05736, -0.01756, 0.2477, 0.01516, 0.1854, 0.09993},
     {-0.02002, 0, 0.402, 0, 0, -0.01684, -0.2482, -0.001854, 0},
     -2.11, -0.6056, -4.257, 0.5273},
    {{0.4359, 0.3219, 0.1323, 0.01287, 0.02026, -0.02566, -0.02702, 0.005946, 0.06114},
     {-1.718, 0, 0.4775, 0, 0, 0.05616, -0.08059, 0.2772, 0},
     -2.197, -0.9505, -1.488, 2.514},
};
/// For denoised means of fewer than kMinGroups groups: by filters, by a network.
inline constexpr FittedErrors kFittedToFew[] = {
    {{-3.814, -0.1735, 0.7402, 0.4716, -0.36, 0.2755, 0.2332, -0.2391, 0.4489},
     {0.1127, 0, -1.515, 0, 0, -0.04931, -0.1346, -0.4538, 0},
     -1.511, -0.5966, -1.818, 2.036},
    {{1.06, -0.01197, -0.3743, 0.02328, 0.0604, 0.1121, -0.006422, -0.05877, -0.03278},
     {-0.9488, 0, 0.8169, 0, 0, -0.2333, -0.06198, 0.07587, 0},
     -1.596, -0.6614, -2.614, 1.649},
};
// clang-format on

/// There is no interval if the largest group of each pixel has a larger fraction of the light that is not common to all
/// groups, if the bounds are wider than this factor, if a larger fraction of the noise is in mirrors or behind glass,
/// if fewer pixels hold the noise, or if there are fewer groups and the kind has no separate fit for few groups.
inline constexpr double kMaxOfLargest = 0.55, kMaxFactor = 5, kMaxSpecular = 0.5;
inline constexpr int kMinPixels = 20, kMinGroups = 8;

}  // namespace covary
