// SPDX-License-Identifier: Apache-2.0
// The published filter of dependent tests [Csonka2002], Sec. 4 and 5. Around each pixel p a square region of m x m
// pixels grows, m = 2 … max_region; its M pixels inside the frame are averaged with the weights
//
//     f_q  = 1/M + sqrt(N) / (3 sigma sqrt(M)) (sum_r Delta_r / M - Delta_q),   Delta_q = |C_d[p] - C_d[q]|
//     f*_q = f_q^+ d_q / sum_r f_r^+ d_r,
//
// sigma and N are those of p, and d_q = max(m / sqrt(2) - distance, 0) is a pyramid that ends at the corners of the
// square; the text has M in place of m, and suggests a spline or a Gaussian (Falloff). Growth stops when a pixel has
// another number of samples than p, or when f*_p falls by less than min_centre_drop; the last accepted region counts.
//
// Left open in the paper and chosen here: squares of even side extend one pixel farther to the right and down, so that
// regions are nested; pixels outside the frame are ignored; a pixel without noise (sigma = 0) or samples (N = 0) stays
// alone.
//
// The weights do not minimise the error bound that the paper derives them from: the root of their sum of squares is
// replaced by 1 / sqrt(M), and negative ones are clamped. In the limit of many samples they tend to (mean Delta -
// Delta_q)^+ d_q and not to 1 at p, so that the filter never vanishes. bound_filter.h has the minimiser.
#pragma once

#include "filters/filter_input.h"

namespace covary {

/// d, the weight of a pixel by its distance from the centre of its region.
enum class Falloff {
  kPyramid,   ///< max(m / sqrt(2) - distance, 0), with the side m
  kCount,     ///< the same with the number M of pixels, as the text of [Csonka2002] has it: nearly flat
  kSpline,    ///< cubic B-spline that ends at the corners, at m / sqrt(2)
  kGaussian,  ///< exp(-(2 distance / m)^2), e^-2 at the corners
};

struct RegionOptions {
  /// Largest side m of a region, 1 … 63; 1: no filter. Default 4 ([Csonka2002] Sec. 6).
  int max_region = 4;
  /// Delta f[0]_min, >= 0: regions grow while the centre's weight falls by at least this much. Default 0.01
  /// ([Csonka2002] Fig. 4).
  float min_centre_drop = 0.01f;
  Falloff falloff = Falloff::kPyramid;
};

/// Result of filtering the independent image. One channel each, except `colour`.
struct FilteredImage {
  Image colour;         ///< RGB; zero where no pixel of the window has samples
  Image region;         ///< number of pixels averaged
  Image centre_weight;  ///< of the pixel itself
  /// The error bound eps = 3 sqrt(sum f_q^2 sigma_q^2 / N_q) + sum f_q Delta_q ([Csonka2002] Sec. 4) in units of the
  /// norm; infinite where there are no samples.
  Image bound;
  /// Effective number of samples of the mean, sigma^2 / (sum f_q^2 sigma_q^2 / N_q).
  Image effective_samples;

  FilteredImage(int width, int height)
      : colour(width, height, 3),
        region(width, height, 1),
        centre_weight(width, height, 1),
        bound(width, height, 1),
        effective_samples(width, height, 1) {}
};

/// Delta is in the norm of the input, whose border must be at least max_region. Bit-identical for any number of
/// threads.
FilteredImage region_filter(const FilterInput& input, const RegionOptions& options);

}  // namespace covary
