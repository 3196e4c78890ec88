// SPDX-License-Identifier: Apache-2.0
// Imperfect image-space control variates. C. Yang, B. Moon, ACM Trans. Graph. 44(6), 2025 [YM2025], Sec. 4.
//
// Two images of the same scene, each of independent groups of samples: the CRN image (all pixels share their random
// numbers) and the independent image (each pixel has its own; "PT" in the paper). Neighbouring pixels of the CRN image
// serve as control variates of a pixel; their unknown expectations are taken from the independent image, and the
// coefficients account for its errors.
//
// The defaults extend the paper in three ways: errors common to all CRN pixels cancel (`mean_constraint`, as calibrated
// weights of surveys do [DevilleSarndal1992]), the penalty contains the expected as well as the realised error of
// independent pixels (`sample_fraction`), and what the penalty removes is restored (`residual_correction`).
// IicvOptions::paper() has none of them. With the first, regions where the CRN image misses light fall back to the
// independent image (missing_light.h).
//
// Consistent, not unbiased: coefficients and penalties are estimated from the samples they are applied to. Pixels of
// the independent image must be independent of each other (box filter), values linear.
//
// Groups of unequal sizes are weighted by their sizes (control_variates.h). If pixels of the independent image have
// unequal counts, the pilot and the residual correction weight them by their counts, as if all had the same variance
// per sample. Every group of every pixel needs a sample.
#pragma once

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"
#include "filters/residual_correction.h"

namespace covary {

class Settings;
struct Method;

/// How the error variances V_h of the independent image are estimated.
enum class Penalty {
  kPilot,   ///< squared difference from a cross-bilateral pilot, [YM2025] Eq. (11): the paper's choice
  kSample,  ///< sample variance of the groups; the paper's ablation
  /// As kPilot, but of the neighbour alone, not the mean of the neighbour's and the target's, [YM2025] end of Sec. 4;
  /// the paper's ablation.
  kAsymmetric,
};

struct IicvOptions {
  /// Number of control variates. Default 25 ([YM2025] Sec. 5, Fig. 11); 1 … number of pixels in the window. More cost
  /// time and gain little.
  int k = 25;
  /// Side of the square window they are chosen from. Default 11 ([YM2025] Sec. 4; 21 for k = 50, 100); odd, 3 … 63.
  int window = 11;
  /// One coefficient per neighbour for all channels (rows stacked) or one per channel. Not specified in the paper.
  bool shared_coefficients = true;
  Penalty penalty = Penalty::kPilot;
  /// Fraction of the penalty that is the sample variance of h (never symmetric) instead of what `penalty` selects, 0 …
  /// 1. The realised error from a pilot detects outliers but depends on the value it judges; the sample variance is
  /// right on average. Default 0.5 (measured); 0 in the paper.
  float sample_fraction = 0.5f;
  /// Weight of the soft constraint that the coefficients reproduce the CRN mean, sum_i beta_i g_i = f; >= 0. It models
  /// an error proportional to brightness, this many times the actual errors and common to all pixels of the CRN image,
  /// which therefore cancels. Default 30 (measured); 0 in the paper.
  float mean_constraint = 30.0f;
  /// Default on; not in the paper (filters/residual_correction.h).
  bool residual_correction = true;
  ResidualCorrectionOptions residual_options;
  /// Also estimate the standard error of the result: [YM2025] Eq. (8), with the residuals of the fit corrected for its
  /// degrees of freedom. It refers to the result before the residual correction, which changes the error little.
  bool std_error = false;
  /// Also find EstimatorResult::covariance, to first order (own_noise.h), including the residual correction's direct
  /// part. With pixels of fewer than 3 independent groups, penalties count as fixed.
  bool covariance = false;
  PixelProbe* probe = nullptr;  ///< optional; inside the image

  /// The published estimator with its published settings.
  static IicvOptions paper();
};

/// Throws Error(kUsage) listing every problem with the inputs, or if k does not fit the window. `crn` needs at least 3
/// groups, `independent` 2 if its sample variance is used, as by default, and 1 otherwise. Bit-identical for any number
/// of threads.
EstimatorResult iicv(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options = {});

/// Radius of influence of the input on a pixel, in rows or columns. A crop that begins at a row and column that are
/// multiples of kResidualCell has the same bits as the whole image farther than this from its cut edges.
int iicv_halo(const IicvOptions& options);

/// Approximate memory of iicv() beyond its input, including its result: bytes per pixel.
double iicv_bytes_per_pixel(const IicvOptions& options);

inline constexpr const char* kIicv = "iicv";
/// The estimator `iicv` with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_iicv(Settings& options);

}  // namespace covary
