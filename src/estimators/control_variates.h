// SPDX-License-Identifier: Apache-2.0
// The estimator all image-space control variates of Yang & Moon 2025 share: Eq. (7) with the coefficients of Eq. (10),
//     F^ = f - sum_i beta_i (g_i - h_i),    beta = (X^T X / (T - 1) + V_h)^-1 X^T y / (T - 1),
// for every pixel, given the error variances V_h. X, y: centred group means of the CRN image at the neighbours and at
// the target; f, g: their means; h: means of the independent image. What V_h is makes the difference between the
// methods (iicv.h, cv_baseline.h).
//
// Unequal group sizes n_t of a pixel: the row of group t in X and y is weighted by sqrt(n_t T / N), N = sum n_t, so
// that all rows have the same variance, and X^T X / (T - 1) estimates T times the covariance of the means as with equal
// sizes. Unequal counts of the CRN image: two pixels share the random numbers of the smaller of their counts, group by
// group, and the covariance of their means follows from that of their group means just so; where their group sizes
// differ from one another by the remainders modulo T, it is too small or too large by about the part that one sample is
// of a group. Unequal counts of the independent image enter through V_h and Eq. (8).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "estimators/estimator_result.h"
#include "film/grouped_image.h"
#include "filters/planes.h"
#include "settings/settings.h"

namespace covary {

/// Smallest V_h,i relative to the variance of the CRN groups at i. It bounds the condition number, so that single
/// precision suffices; both images estimate the same integrals, so that the true ratio is about one. Values from 1e-5
/// to 1e-2 give the same errors within 0.1 % (kitchen, 192 spp).
inline constexpr float kSmallestPenalty = 1e-4f;
/// Ridge that stands for zero (minimum norm), relative to the mean diagonal. The system has condition numbers up to
/// k / ridge, which single precision must hold with its rounding errors.
inline constexpr float kNegligibleRidge = 1e-5f;

struct ControlVariateSettings {
  int k = 25;
  int window = 11;
  bool include_target = true;
  /// One coefficient per neighbour for R, G and B together (rows of X and y stacked, penalties summed), or one each.
  bool shared = true;
  /// V_h,i = (error of the target + error of neighbour i) / 2 instead of the error of neighbour i.
  bool symmetric = true;
  /// Part of V_h,i that is the variance of h_i (`variance_of_h`) instead of `error_of_h`. Not in the paper.
  float sample_fraction = 0;
  /// Weight of the condition sum_i beta_i g_i = f (in each channel); 0: none. X^T X / (T - 1) gets the additional term
  ///     mean_constraint * (S / N) g g^T,   S, N: means over the neighbours of the group variance and of g_i^2,
  /// as if errors in proportion to the brightness, `mean_constraint` times as large as the errors there are, were
  /// common to all pixels. Not in the paper.
  float mean_constraint = 0;
  /// Where positive: V_h = ridge * (mean diagonal of X^T X / (T - 1)) * I instead of `error_of_h`.
  float ridge = 0;
  /// Also estimate the standard error of F^ by Eq. (8), its first part by generalised cross-validation.
  bool std_error = false;
  PixelProbe* probe = nullptr;  ///< optional
};

/// The settings that the options of several estimators have under one name.
template <typename Options>
ControlVariateSettings common_settings(const Options& options) {
  ControlVariateSettings settings;
  settings.k = options.k;
  settings.window = options.window;
  settings.include_target = options.include_target;
  settings.shared = options.shared_coefficients;
  settings.std_error = options.std_error;
  settings.probe = options.probe;
  return settings;
}
/// Adds what is wrong with the number k of control variates.
void check_k(int k, int window, bool include_target, std::vector<std::string>& problems);

struct ControlVariateInput {
  GroupedImage crn;
  const Moments* crn_moments = nullptr;   ///< mean: kFar outside and at invalid pixels
  const Planes* h = nullptr;              ///< 3 planes: mean of the independent image; 0 outside and at invalid pixels
  const Planes* error_of_h = nullptr;     ///< 3 planes: estimated error variance of h; kUseless where there is none
  const Planes* variance_of_h = nullptr;  ///< 3 planes: variance of h; for std_error and sample_fraction
  /// 3 planes, optional: c, light that the CRN image lacks (missing_light.h). The condition becomes
  ///     sum_i beta_i (g_i + c_i) = f + c,   with group variances that are T c_i^2 larger in S,
  /// so that the coefficients of a region where the CRN image is black add up to one; without a condition they stay.
  /// Standard errors contain c - sum_i beta_i c_i.
  const Planes* missing = nullptr;
};

/// Fills `result.estimate` and, where asked for, `result.std_error`; pixels marked 0 in `valid` are left as they come.
/// All planes need a border of at least window / 2. Bit-identical for any number of threads.
void apply_control_variates(const ControlVariateInput& input, const ControlVariateSettings& settings,
                            const std::vector<unsigned char>& valid, EstimatorResult& result);

// Options that several estimators have: the same range and the same words.

/// Largest k: the pixels of the window; validate() knows.
inline constexpr OptionRange kVariatesRange{.low = 1};
inline constexpr const char* kVariatesHelp = "Number of control variates";
inline constexpr OptionRange kWindowRange{.low = 3, .high = 63, .odd = true};
inline constexpr const char* kWindowHelp = "Side of the neighbourhood window";
inline constexpr const char* kExcludeTargetHelp = "Leave the target out of its own control variates";
/// Whether coefficients are shared.
inline constexpr std::pair<const char*, bool> kCoefficients[] = {{"shared", true}, {"per-channel", false}};
inline constexpr const char* kCoefficientsHelp = "One coefficient for all channels, or one per channel";

/// Estimator::reliable_samples of Eq. (8) of [YM2025]. Measured on crops of three scenes, 8 to 192 samples per pixel, 6
/// seeds (docs/notes/iicv.md): with fewer, IICV as published predicts 0.3 to 0.6 of its true squared error.
inline constexpr uint32_t kReliableSamples = 48;

}  // namespace covary
