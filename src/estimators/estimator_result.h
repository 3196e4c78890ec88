// SPDX-License-Identifier: Apache-2.0
// Output of the image-space estimators.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "film/film.h"

namespace covary {

/// What held-out samples tell of the error of a row of pixels (risk/held_out_error.h), relative as in relMSE: sums over
/// its values, each over F'^2 + 0.01.
struct HeldOutRow {
  double error = 0;      ///< squared error of images made of half of the samples
  double variance = 0;   ///< their variance alone
  double predicted = 0;  ///< squared standard error of the image made of all
  double squares = 0;    ///< of `error` of the parts of the row, of which there are `parts`
  int parts = 0;
};

/// What the samples tell of the error of a row of the image (risk/image_risk.h), relative as in relMSE: sums over its
/// values, each over G'^2 + 0.01.
struct RiskRow {
  double error = 0;                                  ///< (M - h)^2 - v + 2 cov(M, h)
  double covariance = 0;                             ///< 2 cov(M, h)
  double squares = 0;                                ///< of `error` of the parts of the row, of which there are `parts`
  double variance = 0;                               ///< of the image: that between halves
  double noise = 0;                                  ///< v
  double noise_squares = 0;                          ///< of v of each pixel
  double specular_noise = 0;                         ///< v of pixels seen in mirrors or through glass
  double light = 0;                                  ///< what the groups hold, over G' + 0.1
  double light_of_largest = 0;                       ///< what the largest group of each pixel holds
  double squared_deviations = 0, fourth_powers = 0;  ///< of groups: squared variance, and fourth moment
  double values = 0, parts = 0;
  double predicted = 0;  ///< by the standard error, before apply_interval(), which sets it
  double groups = 0;     ///< of each pixel; not a sum
};

/// Its sums by name.
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
    {"predicted", &RiskRow::predicted},
    {"values", &RiskRow::values},
    {"parts", &RiskRow::parts},
    {"groups", &RiskRow::groups}};

/// What made an image, as far as it changes what its sums mean: the mean of independent samples; an estimator of two
/// passes; candidates of filters, or of a network, mixed with either.
enum class ErrorKind { kMean, kPair, kFilters, kNetwork, kPairFilters, kPairNetwork };

/// Between which bounds the relMSE is, in 80 of 100 renders (risk/error_interval.h).
struct ErrorInterval {
  double middle = 1;  ///< of the relMSE, over that which the standard errors predict: 1 where these were scaled to it
  double below = 1, above = 1;  ///< factors of the middle: at most 1, and at least 1
  std::string unknown;          ///< why no bounds can be given; empty where they are
};

/// What calibrate() of risk/held_out_error.h found of the predicted error.
struct HeldOutVerdict {
  double uncertainty = 0;  ///< relative standard error of the held-out error; infinite where that is not positive
  double ratio = 1;        ///< squared error that held-out samples tell, over that which the estimator predicts
};

/// What a mixture of images tells of its error and of those of its parts, each alone, as relMSE of all samples.
struct MeasuredRisks {
  /// Of the mixture, by held-out samples alone: comparable where they are the same. May be negative, as it is noisy.
  double held_out = 0;
  double bias_share = 0;  ///< of the mixture's predicted error: what is squared bias
  struct OfImage {
    std::string name;  ///< "mean", or the estimator's; then those of the candidates
    double relmse = 0;
  };
  std::vector<OfImage> images;
};

/// What an estimator returns. `estimate` has the three channels R, G, B. `std_error` and `bias` have them too, or are
/// empty: the first where no error estimate was asked for, the second where no bias is known.
struct EstimatorResult {
  Image estimate;
  Image std_error;
  /// That of each value where it is significant, positive where too bright, zero elsewhere (risk/held_out_bias.h).
  Image bias;
  /// Parts of the estimate that add up to it, for PairSettings::layers in their order; empty where there were none.
  std::vector<Image> layers;
  /// Of a frame of moving pictures: means of both halves of its samples and of those of frames before, for the next one
  /// (denoising/history.h); empty where they were not asked for.
  std::vector<Image> kept_samples;
  /// Pixels with a non-finite value in either input. They are left out everywhere else and show the mean of their
  /// finite groups, or zero where there are none.
  long nonfinite_pixels = 0;
  /// Of each row, for calibrate() of risk/held_out_error.h; empty where nothing was held out.
  std::vector<HeldOutRow> held_out;
  std::vector<RiskRow> risk_rows;  ///< of each row, for apply_interval(); empty where nothing tells of the error
  ErrorKind risk_kind = ErrorKind::kFilters;
  int network_runs = 0;                   ///< of Estimator::network: images and guides that it denoised
  std::optional<RiskRow> risk_sums;       ///< of all rows, by apply_interval()
  std::optional<ErrorInterval> interval;  ///< of the predicted relMSE, by apply_interval()
  std::string note;  ///< what whoever asked for the image should know of how it was made; mostly empty
  std::optional<MeasuredRisks> risks;     ///< of mixtures with a predicted error
  std::optional<HeldOutVerdict> verdict;  ///< by calibrate(); empty where nothing was held out
};

// A look into image-space control variates: what one pixel was made of.

/// One control variate of a pixel: where it is, and its coefficient beta_i of [YM2025] Eq. (7).
struct ControlVariate {
  int dx = 0, dy = 0;  ///< from the target
  float beta[3] = {};  ///< per channel; equal where coefficients are shared
};

/// Asks for the control variates of one pixel, and holds the answer: nearest places first, without places
/// outside the frame; empty where the pixel is not valid.
struct PixelProbe {
  int x = 0, y = 0;
  std::vector<ControlVariate> control_variates;
};

}  // namespace covary
