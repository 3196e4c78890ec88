// SPDX-License-Identifier: Apache-2.0
// Denoising that knows its error (ours): an estimator's image and images with less noise and more bias (candidates.h),
// mixed at each pixel in the proportions that held-out samples find best (mixture.h). The estimator uses two passes, or
// is the mean of a single one.
//
// Claim: consistent if the estimator is, because the weights of biased candidates vanish as samples reveal the bias.
// The error, including bias, is measured (held_out_error.h).
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_parts.h"
#include "denoising/history.h"
#include "estimators/estimator.h"
#include "settings/settings.h"

namespace covary {

/// What the mixture minimises, from least bias to least error.
enum class DenoiseMode {
  kNone,      ///< no denoising
  kAuto,      ///< least error, the default of renders
  kBias,      ///< squared bias counts four times as much as variance; residual correction
  kBalanced,  ///< twice as much; residual correction
  kError,     ///< least error
};

/// For a frame of a sequence, mixed in if there are enough samples for a mixture; layers do not use it.
struct MixingHistory {
  std::shared_ptr<const History> before;  ///< of the previous frame; or null
  bool keep_samples = false;              ///< EstimatorResult::kept_samples, of a mean denoised by a network
};

struct MixedDenoisingOptions {
  DenoiseMode mode = DenoiseMode::kBalanced;
  bool use_oidn = true;  ///< use Open Image Denoise, if it is installed
  DenoiseOptions oidn;   ///< path of its library; an error if it is not there
  MixingHistory history;
};

/// Denoises the estimator's image. `base` is either a two-pass estimator that predicts its error, and the result needs
/// twice its groups; or the mean, and the result takes a single pass (EstimatorPasses::kIndependent), mixed with at
/// least kFewestMixedSamples samples and otherwise the best single candidate. Reads guides and needs the whole image.
/// Throws Error(kUsage) for any other base.
Estimator with_denoising(const Estimator& base, const MixedDenoisingOptions& options);

/// Whether an estimator can be the base.
bool can_be_denoised(const Estimator& estimator);

/// MixedDenoisingOptions as texts, as the command line has them.
struct DenoisingChoice {
  std::string mode = "none";  ///< one of denoise_mode_names()
  std::string oidn;           ///< a library or its folder; "": searched for, "off": not used
  MixingHistory history;      ///< MixedDenoisingOptions::history; there is no text for it
  bool denoises() const { return mode != "none"; }
  bool uses_oidn() const { return denoises() && oidn != "off"; }
};
/// `is_all`: the caller uses Open Image Denoise for nothing else, so `oidn` without `denoise` is an error.
void declare(Settings& settings, DenoisingChoice& choice, bool is_all = true);
constexpr const char* kNotDenoised = "without `denoise` auto, bias, balanced or error";

/// The note that Open Image Denoise is wanted but missing, and how to get it; empty if it is found or not wanted.
std::string missing_network(const DenoisingChoice& choice);

/// Implements with_denoising(), for any candidates.
struct MixedDenoising {
  EstimatorResult result;
  std::vector<std::string> names;  ///< of the candidates
  std::vector<Image> candidates;   ///< made of all samples
  std::vector<Image> weights;      ///< one channel each
};
/// `std_error`: estimate the result's error. `layers`: of a mean; the result then has layers, too.
MixedDenoising denoise_by_mixture(DenoisingParts parts, const std::vector<CandidateMaker>& makers, DenoiseMode mode,
                                  bool std_error, std::span<const Layer> layers = {},
                                  const MixingHistory& history = {});

/// Samples per pixel from which on halves, of two groups or more, can judge candidates.
inline constexpr int kFewestMixedSamples = 4;

/// The modes by name, "none" first.
const std::vector<std::string>& denoise_mode_names();
/// Throws Error(kUsage) for an unknown name.
DenoiseMode denoise_mode(const std::string& name);

}  // namespace covary
