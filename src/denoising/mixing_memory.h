// SPDX-License-Identifier: Apache-2.0
// The memory that mixtures of denoised images (mixed_denoising.h) take.
#pragma once

namespace covary {

/// A mixture around the mean of groups of samples.
struct MixtureSize {
  int groups = 2;
  bool has_features = true, has_network = false;
};

/// Bytes per pixel, approximately, beside the samples and the auxiliary features themselves. In bands of rows, the
/// network has denoised the whole image before (network_memory.h).
double bytes_of_mixture(const MixtureSize& size);
/// Bytes of the network and of what is in memory while it denoises an image of so many pixels in one piece.
double memory_beside_network(const MixtureSize& size, double n_pixels);

/// Bytes of the rows that bands of this radius of influence keep for the next, in images of so many columns.
double memory_of_kept_rows(int halo, double width);

/// Bytes per pixel around the image of a pair of passes, beside what its estimator takes.
double bytes_of_pair_mixture(bool with_network);

}  // namespace covary
