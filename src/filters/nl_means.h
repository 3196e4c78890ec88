// SPDX-License-Identifier: Apache-2.0
// NL-means guided by an image and its estimated error: Rousselle, Knaus, Zwicker, ACM Trans. Graph. 31(6), 2012
// [RKZ2012], Eq. (1), with feature buffers as in Rousselle, Manzi, Zwicker, Comput. Graph. Forum 32(7), 2013 [RMZ2013].
// For the pixels j of a window around i
//
//     d_ij = mean over 3 x 3 patch and RGB of ((f_i - f_j)^2 - (s_i^2 + min(s_i^2, s_j^2))) / (s_i^2 + s_j^2),
//     w_ij = exp(-max(d_ij / k^2, ||q_i - q_j||^2, 0)),
//
// f: the steering image, s: its standard error, q: features divided by their tolerance, k: bandwidth. Patches that
// extend beyond the frame repeat its outermost pixels.
#pragma once

#include <span>
#include <vector>

#include "filters/planes.h"
#include "filters/wanted_rows.h"

namespace covary {

/// Images averaged with the same weights.
struct NlMeansTask {
  float bandwidth = 0.5f;  ///< k > 0
  std::vector<const Image*> sources;
};

/// An image that determines the weights of some tasks.
struct NlMeansSteering {
  const Image* image = nullptr;      ///< f
  const Image* std_error = nullptr;  ///< s; where both are zero, only equal pixels match
  std::vector<NlMeansTask> tasks;
};

/// Radius of the window of weights around a pixel.
inline constexpr int kNlMeansRadius = 10;
/// Radius of influence of the input on a pixel, in rows or columns.
inline constexpr int kNlMeansHalo = kNlMeansRadius + 1;

/// The weighted means of all sources of all tasks of all steerings, in this order. Tasks of one steering share their
/// distances, and all steerings those of the features, so that further ones cost less. Pixels whose weights are all
/// zero keep the source's value. All images must have three channels, the same size and finite values. Bit-identical
/// for any number of threads. `features`: q, any number of planes, border of at least kNlMeansRadius; may be null.
/// `valid`: pixels with 0 are left out of all sums. Of rows of a larger image, those at least kNlMeansHalo away from
/// those that are missing have the bits of the whole.
std::vector<Image> nl_means(std::span<const NlMeansSteering> steerings, const Planes* features,
                            const std::vector<unsigned char>& valid, const WantedRows& wanted = {});

}  // namespace covary
