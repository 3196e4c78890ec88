// SPDX-License-Identifier: Apache-2.0
// Input-dependent uncorrelated weighting. J. Back, B.-S. Hua, T. Hachisuka, B. Moon, SIGGRAPH Asia 2023 [Back2023], in
// the form of a control variate estimator ([YM2025], supplementary). A comparator.
//
//     F^ = h_c + 1 / (W - 1) sum_{i != c} w_i ((g_c - g_i) - (h_c - h_i)),   W: pixels in the window,
//     w_i = exp(-gamma n (D_A - D_B)^2) per channel,  D_A, D_B: g_c - g_i from two halves of the CRN samples,
// g: CRN, h: independent. gamma is chosen for the image: quarters make the weights of each half, and the value whose
// two results differ least is taken. The image is reflected at its borders.
//
// Groups of unequal sizes are weighted by them in every mean: of the image, halves and quarters. Where pixels have
// unequal counts, n is one number all the same, and the sum over the window gives all pixels the weights of the method:
// pixels with fewer samples than n are trusted too little, others too much. Every group of every pixel needs a sample.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

class Settings;
struct Estimator;

struct IduwOptions {
  /// Side of the window; default 15, as in the authors' program; odd, 3 … 63.
  int window = 15;
  /// n: samples per pixel of the CRN image, their mean where pixels differ, > 0. It sets the scale of gamma; required.
  /// The authors' program uses the same n for quarters, and so does this.
  int samples = 0;
  /// Candidates for gamma, all > 0; default the ten of the authors' program.
  std::vector<float> gammas = {0.01f, 0.025f, 0.05f, 0.1f, 0.2f, 0.5f, 1.0f, 1.5f, 2.0f, 2.5f};

  std::vector<std::string> validate() const;
};

/// Claim: consistent; biased through the weights. Throws Error(kUsage) that lists every problem; both images need at
/// least 4 groups (group t belongs to quarter t mod 4 and half t mod 2). `chosen_gamma`, if not null, receives the
/// choice.
EstimatorResult iduw(const GroupedImage& crn, const GroupedImage& independent, const IduwOptions& options,
                     float* chosen_gamma = nullptr);

/// Memory that iduw() takes beside its input, its result included: bytes per pixel, about.
inline constexpr double kIduwBytesPerPixel = (10 * 3 + 6 + 3) * sizeof(float) + 1;

/// The estimator `iduw` with these options. Throws Error(kUsage) that lists everything that is wrong with them.
Estimator make_iduw(Settings& options);

}  // namespace covary
