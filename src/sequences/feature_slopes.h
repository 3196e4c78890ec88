// SPDX-License-Identifier: Apache-2.0
// Local linear regression of a picture on features, here albedo and normal (without weights, unlike [Bitterli2016]).
#pragma once

#include <array>

#include "denoising/history.h"

namespace covary {

/// Albedo and normal as one image of 6 channels; empty if either is.
Image history_features(const Image& albedo, const Image& normal);

/// The slope of colour channel c over feature i is at 3 i + c.
using FeatureSlopes = std::array<float, 3 * kHistoryFeatures>;

/// Ridge regression over the finite pixels j of the 7 x 7 around (x, y): minimises the mean of (s_j - a - b x_j)^2 plus
/// 0.001 ||b||^2 over a and b, for the colours s_j of 3 channels and the features x_j. Returns b; 0 if fewer than two
/// pixels are finite.
FeatureSlopes feature_slopes(const Image& picture, const Image& features, int x, int y);

}  // namespace covary
