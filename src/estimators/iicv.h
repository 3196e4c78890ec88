// SPDX-License-Identifier: Apache-2.0
// Imperfect image-space control variates. C. Yang, B. Moon, ACM Trans. Graph. 44(6), 2025 [YM2025], Sec. 4.
//
// Two images of one scene, each of independent groups of samples: the CRN image (all pixels use the same random
// numbers) and the independent image (each pixel has its own; "PT" in the paper). Neighbouring pixels of the CRN image
// are control variates of a pixel; their unknown expectations are taken from the independent image, and the
// coefficients allow for its errors.
//
// The defaults go beyond the paper in three places, each an option: errors common to all CRN pixels cancel
// (`mean_constraint`), the penalty contains the expected beside the realised error of independent pixels
// (`sample_fraction`), and what the penalty takes away is given back (`residual_correction`). IicvOptions::paper() has
// none of them. With the first, regions where the CRN image misses the light fall back to the independent image
// (missing_light.h).
//
// Claim: consistent, not unbiased; coefficients and penalties are estimated from the samples they are applied to.
// Pixels of the independent image must be independent of each other (box filter), values linear.
//
// Groups of unequal sizes are weighted by their sizes (control_variates.h). Where pixels of the independent image have
// unequal counts, the pilot and the residual correction weight them by their counts, as if all had the same variance
// per sample. Every group of every pixel needs a sample.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"
#include "filters/residual_correction.h"

namespace covary {

class Settings;
struct Estimator;

/// How the error variances V_h of the independent image are estimated.
enum class Penalty {
  kPilot,   ///< squared difference from a cross-bilateral pilot, [YM2025] Eq. (11): the paper's
  kSample,  ///< sample variance of the groups; the paper's ablation
};

struct IicvOptions {
  /// Number of control variates. Default 25 ([YM2025] Sec. 5, Fig. 11); 1 … number of pixels in the window. More costs
  /// time and gains little.
  int k = 25;
  /// Side of the square they are chosen from. Default 11 ([YM2025] Sec. 4; 21 for k = 50, 100); odd, 3 … 63.
  int window = 11;
  /// Whether the target pixel is one of its own control variates; without it its independent value is unused. Default
  /// true (the paper does not say; measured).
  bool include_target = true;
  /// One coefficient per neighbour for all channels (rows stacked) or one per channel. The paper does not say.
  bool shared_coefficients = true;
  /// Penalty from the mean of the neighbour's and the target's error, [YM2025] end of Sec. 4. Default true.
  bool symmetric = true;
  Penalty penalty = Penalty::kPilot;
  /// Side of the pilot's window. Default 11 ([YM2025] Eq. (11)); odd, 3 … 63.
  int pilot_window = 11;
  /// Part of the penalty that is the sample variance of h instead of what `penalty` says (and never symmetric), 0 … 1.
  /// The realised error of a pilot tells outliers but depends on the value it judges; the sample variance is right on
  /// average. Default 0.5 (measured); the paper has 0.
  float sample_fraction = 0.5f;
  /// Weight of the condition that the coefficients reproduce the CRN mean, sum_i beta_i g_i = f; >= 0. It treats errors
  /// in proportion to brightness, so many times as large as the errors there are, as common to all pixels of the CRN
  /// image, and so cancels them. Default 30 (measured); the paper has 0.
  float mean_constraint = 30.0f;
  /// Default on; the paper has none (filters/residual_correction.h).
  bool residual_correction = true;
  ResidualCorrectionOptions residual_options;
  /// Also estimate the standard error of the result: [YM2025] Eq. (8), with the residuals of the fit corrected for its
  /// degrees of freedom. It is the error before the residual correction, which changes it little.
  bool std_error = false;
  PixelProbe* probe = nullptr;  ///< optional; inside the image

  /// The published estimator with its published settings.
  static IicvOptions paper();
  /// Everything that is wrong with the options; empty if nothing is.
  std::vector<std::string> validate() const;
};

/// Throws Error(kUsage) that lists every problem of options and inputs. `crn` needs at least 3 groups, `independent` 2
/// where its sample variance is used, as with the defaults, and otherwise 1. Bit-identical for any number of threads.
EstimatorResult iicv(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options = {});

/// How far from a pixel, in rows or columns, the input can influence it. A part of an image that begins at a row and
/// column that are multiples of kResidualCell gives, farther than this from its cut edges, the bits of the whole image.
int iicv_reach(const IicvOptions& options);

/// Memory that iicv() takes beside its input, its result included: bytes per pixel, about.
double iicv_bytes_per_pixel(const IicvOptions& options);

/// The estimator `iicv` with these options. Throws Error(kUsage) that lists everything that is wrong with them.
Estimator make_iicv(Settings& options);

}  // namespace covary
