// SPDX-License-Identifier: Apache-2.0
// The error of an image from held-out samples (ours). M_A and M_B were made of the two halves of all samples by the
// same method, h_A and h_B are the halves' independent images. Then, on average,
//
//     (M_A - h_B)^2 - var h_B   is the squared error of M_A, bias included,
//     (M_A - M_B)^2 / 2         is its variance alone.
//
// The second has little noise and tells where the error is: its mean over pixels that look alike (guided_cells.h) is
// the error's shape. The first, over the whole image, tells how large it is: with squared bias e - v of a half, that of
// the whole is e - v + v / 2. Where light is rare e is noise, and what the error usually is over v decides.
#pragma once

#include <array>
#include <vector>

#include "estimators/estimator.h"
#include "filters/planes.h"

namespace covary {

struct HeldOutInput {
  std::array<const Image*, 2> halves = {};            ///< M_A, M_B
  std::array<const Moments*, 2> independent = {};     ///< h_A, h_B and the variances of their pixels
  const Image* guide = nullptr;                       ///< G of guided_cells.h
  const std::vector<unsigned char>* valid = nullptr;  ///< pixels with 0 are left out, and have no error
  double error_over_variance = 0.5;                   ///< what the whole's error over v usually is; without bias 1/2
  /// By how much images that were made otherwise of the same samples differ from the whole's, squared and relative, one
  /// channel; null: there are none. Of held_out_error() only.
  const Image* disagreement = nullptr;
};

/// The estimated standard error of an image that the same method made of both halves. How large it is in all follows
/// from these. Where it is, the disagreement knows better: bias has a part in that, which halves have in common
/// (docs/notes/error-estimates.md). Bit-identical for any number of threads.
Image held_out_error(const HeldOutInput& input);

/// What both halves tell of their images, as means over the values, each over G'^2 + 0.01.
struct HalvesRisk {
  double error = 0;     ///< squared error of a half's image, bias included; may be negative, as it is noisy
  double variance = 0;  ///< of a half's image
  /// Of the image of all samples: the bias of a half and half of its variance.
  double of_whole() const { return error - 0.5 * variance; }
};
/// With the guide. Differences between images of the same halves have less noise than the errors themselves, since the
/// held-out samples are the same.
HalvesRisk risk_of_halves(const HeldOutInput& input);

/// An estimator that fills EstimatorResult::held_out and risk_rows beside its standard error where both halves of the
/// groups are enough for it; only of those with Estimator::holds_out, others are returned as they are.
Estimator with_held_out_rows(const Estimator& base);

/// Scales the standard error so that its relMSE is between what the estimator predicts and what held-out samples tell:
/// nearer to the latter the better these know it. With their relative standard error c, the logarithm of the ratio of
/// both counts 1 / (1 + (c / 0.3)^2). Held-out samples see bias; few of them may have missed rare light. Empties
/// `result.held_out` and fills `result.verdict`; does nothing where it is empty.
void calibrate(EstimatorResult& result);

}  // namespace covary
