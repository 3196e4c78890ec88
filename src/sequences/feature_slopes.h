// SPDX-License-Identifier: Apache-2.0
// How a picture changes with what is seen: its slopes over features, here albedo and normal.
#pragma once

#include <array>

#include "film/film.h"

namespace covary {

/// Channels of albedo and normal.
inline constexpr int kHistoryFeatures = 6;

/// Albedo and normal as one image; empty where one is.
Image history_features(const Image& albedo, const Image& normal);

/// Of feature i and channel c at 3 i + c.
using FeatureSlopes = std::array<float, 3 * kHistoryFeatures>;

/// Least squares over the 7 x 7 pixels around (x, y) that are in the image and finite, with a ridge: minimises the mean
/// of (s_j - a - b x_j)^2 plus 0.001 ||b||^2, for the colours s_j of 3 channels and the features x_j. All are 0 where
/// no two pixels are finite.
FeatureSlopes feature_slopes(const Image& picture, const Image& features, int x, int y);

}  // namespace covary
