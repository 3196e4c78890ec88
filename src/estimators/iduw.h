// SPDX-License-Identifier: Apache-2.0
// Input-dependent uncorrelated weighting. J. Back, B.-S. Hua, T. Hachisuka, B. Moon, SIGGRAPH Asia 2023 [Back2023], in
// the form of a control variate estimator ([YM2025], supplementary). For comparison.
//
//     F^ = h_c + 1 / (W - 1) sum_{i != c} w_i ((g_c - g_i) - (h_c - h_i)),   W: pixels in the window,
//     w_i = exp(-gamma n (D_A - D_B)^2) per channel,  D_A, D_B: g_c - g_i from two halves of the CRN samples,
// g: CRN, h: independent. gamma is chosen per image: quarters of the samples give the weights for each half, and the
// value whose two results differ least wins. The image is reflected at its borders.
//
// Unequal group sizes weight every mean: of the image, halves and quarters. If pixels have unequal counts, n is still a
// single number, and all pixels in the window count equally: pixels with fewer samples than n are trusted too little,
// others too much. Every group of every pixel needs a sample.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary {

class Settings;
struct Method;

struct IduwOptions {
  /// Side of the window; default 15, as in the authors' code; odd, 3 … 63.
  int window = 15;
  /// n: samples per pixel of the CRN image, or their mean if pixels differ, > 0. It sets the scale of gamma; required.
  /// The authors' code uses the same n for quarters, and so do we.
  int samples = 0;
  /// Candidates for gamma, all > 0; default the ten of the authors' code.
  std::vector<float> gammas = {0.01f, 0.025f, 0.05f, 0.1f, 0.2f, 0.5f, 1.0f, 1.5f, 2.0f, 2.5f};
};

/// Consistent; biased through the weights. Throws Error(kUsage) listing every problem with the inputs; both images need
/// at least 4 groups (group t belongs to quarter t mod 4 and half t mod 2). `chosen_gamma`, if not null, receives the
/// choice.
EstimatorResult iduw(const GroupedImage& crn, const GroupedImage& independent, const IduwOptions& options,
                     float* chosen_gamma = nullptr);

/// Approximate memory of iduw() beyond its input, including its result: bytes per pixel.
inline constexpr double kIduwBytesPerPixel = (10 * 3 + 6 + 3) * sizeof(float) + 1;

inline constexpr const char* kIduw = "iduw";
/// The estimator `iduw` with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_iduw(Settings& options);

}  // namespace covary
