// SPDX-License-Identifier: Apache-2.0
// The error of an image from held-out samples, the half buffers of [RKZ2011] and [RKZ2012]. The same method made M_A
// and M_B from the two halves of all samples; h_A and h_B are the halves' independent images. Then, on average,
//
//     (M_A - h_B)^2 - var h_B   is the squared error of M_A, bias included,
//     (M_A - M_B)^2 / 2         is its variance alone.
//
// The second has little noise and shows where the error is: its mean over similar pixels (guided_cells.h) gives the
// error's spatial distribution. The first, over the whole image, shows its size: with the squared bias e - v of a half,
// the error of the whole is e - v + v / 2. If light is rare, e is mostly noise, and the typical ratio of error to v is
// used instead.
#pragma once

#include <array>
#include <vector>

#include "estimators/method.h"
#include "filters/planes.h"

namespace covary {

/// What held-out samples tell of the error of a row of pixels, relative as in relMSE: sums over its values, each
/// divided by G'^2 + 0.01.
struct HeldOutRow {
  double error = 0;     ///< squared error of images made from half of the samples
  double variance = 0;  ///< its variance part
  double squares = 0;   ///< sum of squared `error` of the `parts` segments of the row
  int parts = 0;
};

struct HeldOutInput {
  std::array<const Image*, 2> halves = {};            ///< M_A, M_B
  std::array<const Moments*, 2> independent = {};     ///< h_A, h_B and the variances of their pixels
  const Image* guide = nullptr;                       ///< G of guided_cells.h
  const std::vector<unsigned char>* valid = nullptr;  ///< pixels with 0 are ignored and have no error
};

/// The parts of an image's estimated error, for the whole image or for rows of it.
struct HeldOutParts {
  /// The standard error as far as halves show where it is, up to a factor that is the same for all pixels.
  Image relative;
  Image weight;                  ///< of squared errors: 1 / (G'^2 + 0.01), one channel
  std::vector<HeldOutRow> rows;  ///< sums over each row
};
/// Radius of influence of the input on a pixel, in rows. Cells are aligned to multiples of kResidualCell.
inline constexpr int kHeldOutHalo = 32;
HeldOutParts held_out_parts(const HeldOutInput& input);

/// The estimated standard error of an image that the same method made from both halves. These determine its size; its
/// spatial distribution follows `disagreement`, if given, because halves share their bias
/// (docs/notes/error-estimates.md): relative squared differences of the whole image from others made differently from
/// the same samples, one channel; empty: unknown. `error_over_variance`: typical ratio of the whole's error to v; 1/2
/// without bias. Bit-identical for any number of threads.
Image held_out_error(HeldOutParts parts, const Image& disagreement, double error_over_variance = 0.5);

/// Errors of the halves' images, as means over values, each divided by G'^2 + 0.01.
struct HalvesRisk {
  double error = 0;     ///< squared error of a half's image, including bias; noisy, so it may be negative
  double variance = 0;  ///< of a half's image
  /// Of the image of all samples: the bias of a half, and half of its variance.
  double of_whole() const { return error - 0.5 * variance; }
};
/// The sums over each row, with the weights of the guide.
std::vector<HeldOutRow> held_out_rows(const HeldOutInput& input);
/// Differences between images of the same halves are less noisy than the errors, because the held-out samples are the
/// same.
HalvesRisk risk_of_halves(const std::vector<HeldOutRow>& rows, double n_valid_pixels);

/// A method that also tells the error of its image, if the samples have enough groups for halves: from the covariance
/// with them if the method tells it (EstimatorResult::covariance), otherwise from images of both halves, with its bias.
/// Only for methods with Method::holds_out; others are returned unchanged.
Method with_held_out_rows(const Method& base);

}  // namespace covary
