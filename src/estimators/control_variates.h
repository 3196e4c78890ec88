// SPDX-License-Identifier: Apache-2.0
// The estimator shared by all image-space control variates of Yang & Moon 2025: Eq. (7) with the coefficients of
// Eq. (10),
//     F^ = f - sum_i beta_i (g_i - h_i),    beta = (X^T X / (T - 1) + V_h)^-1 X^T y / (T - 1),
// for every pixel, given the error variances V_h. X, y: centred group means of the CRN image at the neighbours and at
// the target; f, g: their means; h: means of the independent image. Methods differ in their choice of V_h
// (iicv.h, cv_baseline.h).
//
// Unequal group sizes n_t within a pixel: the row of group t in X and y is weighted by sqrt(n_t T / N), N = sum n_t, so
// that all rows have the same variance and X^T X / (T - 1) estimates T times the covariance of the means, as with equal
// sizes. Unequal counts in the CRN image: two pixels share the random numbers of the smaller of their counts, group by
// group, and the covariance of their means follows from that of their group means in the same way; where their group
// sizes differ from one another by the remainders modulo T, it is off by about the fraction that one sample is of a
// group. Unequal counts in the independent image enter through V_h and Eq. (8).
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "estimators/estimator_result.h"
#include "estimators/own_noise.h"
#include "film/grouped_image.h"
#include "filters/planes.h"
#include "settings/settings.h"

namespace covary {

/// Lower bound on V_h,i relative to the variance of the CRN groups at i. It bounds the condition number, so that single
/// precision suffices; both images estimate the same integrals, so the true ratio is about one. Values from 1e-5 to
/// 1e-2 give the same errors to within 0.1 % (kitchen, 192 spp).
inline constexpr float kSmallestPenalty = 1e-4f;
/// Ridge used for a ridge of zero (minimum norm), relative to the mean diagonal. Condition numbers reach k / ridge,
/// which single precision must handle.
inline constexpr float kNegligibleRidge = 1e-5f;

struct ControlVariateSettings {
  int k = 25;
  int window = 11;
  /// One coefficient per neighbour shared by R, G and B (rows of X and y stacked, penalties summed), or one per
  /// channel.
  bool shared = true;
  /// V_h,i = (error of the target + error of neighbour i) / 2 instead of the error of neighbour i alone.
  bool symmetric = true;
  /// Fraction of V_h,i taken from the variance of h_i (`variance_of_h`) instead of `error_of_h`. Not in the paper.
  float sample_fraction = 0;
  /// Weight of the soft constraint sum_i beta_i g_i = f (per channel); 0: none. Adds to X^T X / (T - 1) the term
  ///     mean_constraint * (S / N) g g^T,   S, N: means over the neighbours of the group variance and of g_i^2,
  /// as if all pixels shared an error proportional to brightness and `mean_constraint` times as large as the actual
  /// errors. Not in the paper.
  float mean_constraint = 0;
  /// If positive: V_h = ridge * (mean diagonal of X^T X / (T - 1)) * I instead of `error_of_h`.
  float ridge = 0;
  /// Also estimate the standard error of F^ by Eq. (8), with its first part by generalised cross-validation.
  bool std_error = false;
  PixelProbe* probe = nullptr;  ///< optional
};

/// The settings that the options of several estimators share under the same names.
template <typename Options>
ControlVariateSettings common_settings(const Options& options) {
  ControlVariateSettings settings;
  settings.k = options.k;
  settings.window = options.window;
  settings.shared = options.shared_coefficients;
  settings.std_error = options.std_error;
  settings.probe = options.probe;
  return settings;
}
/// Appends problems with the number k of control variates: at most the number of pixels in the window.
void check_k(int k, int window, std::vector<std::string>& problems);

struct ControlVariateInput {
  GroupedImage crn;
  const Moments* crn_moments = nullptr;   ///< mean: kFar outside and at invalid pixels
  const Planes* h = nullptr;              ///< 3 planes: mean of the independent image; 0 outside and at invalid pixels
  const Planes* error_of_h = nullptr;     ///< 3 planes: estimated error variance of h; kUseless where unavailable
  const Planes* variance_of_h = nullptr;  ///< 3 planes: variance of h; for std_error and sample_fraction
  /// 3 planes, optional: c, light that the CRN image lacks (missing_light.h). The constraint becomes
  ///     sum_i beta_i (g_i + c_i) = f + c,   with T c_i^2 added to the group variances in S,
  /// so that the coefficients in a region where the CRN image is black sum to one; without the constraint they are
  /// unchanged. Standard errors include c - sum_i beta_i c_i.
  const Planes* missing = nullptr;
  const OwnChanges* changes = nullptr;  ///< optional: also find EstimatorResult::covariance
};

/// Fills `result.estimate` and, if requested, `result.std_error`; pixels with 0 in `valid` are left unchanged. All
/// planes need a border of at least window / 2. Bit-identical for any number of threads.
void apply_control_variates(const ControlVariateInput& input, const ControlVariateSettings& settings,
                            const std::vector<unsigned char>& valid, EstimatorResult& result);

// Options of several estimators, with the same range and help text.

/// The maximum of k is checked by check_k().
inline constexpr OptionRange kVariatesRange{.low = 1};
inline constexpr const char* kVariatesHelp = "Number of control variates";
inline constexpr OptionRange kWindowRange{.low = 3, .high = 63, .odd = true};
inline constexpr const char* kWindowHelp = "Side of the neighbourhood window";

/// Method::reliable_samples for Eq. (8) of [YM2025]. Measured on crops of three scenes, 8 to 192 samples per pixel,
/// 6 seeds (docs/notes/iicv.md): with fewer samples, IICV as published predicts 0.3 to 0.6 of its true squared error.
inline constexpr uint32_t kReliableSamples = 48;

}  // namespace covary
