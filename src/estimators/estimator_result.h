// SPDX-License-Identifier: Apache-2.0
// Output of the image-space estimators.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "film/film.h"

namespace covary {

/// What the samples reveal about the error of a row of the image (risk/image_risk.h), relative as in relMSE: sums over
/// its values, each divided by G'^2 + 0.01.
struct RiskRow {
  double error = 0;                                  ///< (M - h)^2 - v + 2 cov(M, h)
  double covariance = 0;                             ///< 2 cov(M, h)
  double squares = 0;                                ///< sum of squared `error` of the `parts` segments of the row
  double variance = 0;                               ///< of the image, from the difference of halves
  double noise = 0;                                  ///< v
  double noise_squares = 0;                          ///< sum over pixels of v^2
  double specular_noise = 0;                         ///< v of pixels seen in mirrors or through glass
  double light = 0;                                  ///< light in the groups, over G' + 0.1
  double light_of_largest = 0;                       ///< light in the largest group of each pixel, likewise
  double squared_deviations = 0, fourth_powers = 0;  ///< of group means: squared variance, and fourth moment
  /// (M - h)^2 - v where M is ten times as bright as h at the pixel and around it, over that brightness squared
  double spread = 0;
  double values = 0, parts = 0;
  double predicted = 0;  ///< from the standard error, which with_error() sets
  double groups = 0;     ///< number per pixel; not a sum
};

/// The sums by name.
inline constexpr std::pair<const char*, double RiskRow::*> kRiskSums[] = {
    {"error", &RiskRow::error},
    {"covariance", &RiskRow::covariance},
    {"squares", &RiskRow::squares},
    {"variance", &RiskRow::variance},
    {"noise", &RiskRow::noise},
    {"noise_squares", &RiskRow::noise_squares},
    {"specular_noise", &RiskRow::specular_noise},
    {"light", &RiskRow::light},
    {"light_of_largest", &RiskRow::light_of_largest},
    {"squared_deviations", &RiskRow::squared_deviations},
    {"fourth_powers", &RiskRow::fourth_powers},
    {"spread", &RiskRow::spread},
    {"predicted", &RiskRow::predicted},
    {"values", &RiskRow::values},
    {"parts", &RiskRow::parts},
    {"groups", &RiskRow::groups}};

/// How an image was made, as far as it affects the meaning of these sums: mean of independent samples; an estimator of
/// two passes; candidates from filters, or from a network, mixed with either; or an estimator of two passes whose
/// covariance with the samples is known from halves of them only, as on a device.
enum class ErrorKind { kMean, kPair, kFilters, kNetwork, kPairFilters, kPairNetwork, kPairHalves };

/// Bounds that contain the relMSE in 80 of 100 renders (risk/error_interval.h).
struct ErrorInterval {
  double middle = 1;  ///< of the relMSE, relative to the prediction by standard errors: 1 if these were scaled to it
  double below = 1, above = 1;  ///< the bounds, relative to the middle: at most 1, and at least 1
  std::string unknown;          ///< why no bounds can be given; empty if they are
};

/// Measured errors of a mixture of images and of each of its parts alone, as relMSE at all samples.
struct MeasuredRisks {
  /// Of the mixture, by held-out samples alone: comparable for the same held-out samples. Noisy, so it may be negative.
  double held_out = 0;
  double bias_share = 0;  ///< fraction of the mixture's predicted error that is squared bias
  struct OfImage {
    std::string name;  ///< "mean", or the estimator's name; then the candidates' names
    double relmse = 0;
  };
  std::vector<OfImage> images;
};

/// An image and its error. `estimate` has the three channels R, G, B. So do `std_error` and `bias`, or they are empty:
/// the first if no error estimate was requested, the second if no bias is known.
struct EstimatorResult {
  Image estimate;
  Image std_error;
  /// Bias of each value where it is significant, positive if too bright; zero elsewhere (risk/held_out_bias.h).
  Image bias;
  /// Covariance of each value with the mean of the independent samples at the same pixel; empty if unknown. It tells
  /// the error of the estimate (risk/image_risk.h).
  Image covariance;
  /// Layers of the estimate that sum to it, in the order of MethodSettings::layers; empty if there were none.
  std::vector<Image> layers;
  /// For animation frames: means of both halves of the samples of this and previous frames, for the next frame
  /// (denoising/history.h); empty if not requested.
  std::vector<Image> kept_samples;
  /// Pixels with a value in either input that is not usable (filters/planes.h). They are ignored everywhere else, and
  /// set to the mean of their usable groups, or else of the pixels around.
  long nonfinite_pixels = 0;
  int network_runs = 0;                   ///< runs of Method::network: images and auxiliary images denoised
  std::string note;                       ///< a remark for the user on how the image was made; usually empty
  std::optional<MeasuredRisks> risks;     ///< of mixtures with a predicted error
  std::optional<RiskRow> risk_sums;       ///< over all rows, where samples tell the error (risk/error_interval.h)
  std::optional<ErrorInterval> interval;  ///< of the predicted relMSE, likewise
};

/// What a method makes: an image whose error is not yet derived from what the samples tell of it, row by row.
/// with_error() of risk/error_interval.h does that.
struct MethodImage : EstimatorResult {
  std::vector<RiskRow> risk_rows;  ///< one per row; empty if the samples tell nothing
  ErrorKind risk_kind = ErrorKind::kFilters;

  MethodImage() = default;
  MethodImage(EstimatorResult result) : EstimatorResult(std::move(result)) {}
};

// Inspection of image-space control variates: what one pixel was computed from.

/// One control variate of a pixel: its position, and its coefficient beta_i of [YM2025] Eq. (7).
struct ControlVariate {
  int dx = 0, dy = 0;  ///< relative to the target
  float beta[3] = {};  ///< per channel; equal if coefficients are shared
};

/// Requests the control variates of one pixel and receives them: nearest first, without those outside the frame; empty
/// if the pixel is invalid.
struct PixelProbe {
  int x = 0, y = 0;
  std::vector<ControlVariate> control_variates;
};

}  // namespace covary
