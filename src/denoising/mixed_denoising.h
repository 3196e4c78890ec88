// SPDX-License-Identifier: Apache-2.0
// Denoising with an error estimate: mixes an estimator's image with images of less noise and more bias
// (candidates.h), with weights per pixel that have the least error by held-out samples (mixture.h). The estimator uses
// two passes, or is the mean of a single one.
//
// Such mixtures are Ensemble Denoising [Zheng2021], there of denoisers alone; that a denoised image be mixed with its
// noisy input is in [Back2020], [Firmino2022], [Gu2022]. docs/methods/denoising.md says what differs.
//
// Claim: consistent if the estimator is, because the weights of biased candidates vanish as samples reveal the bias.
// The error, including bias, is measured (held_out_error.h).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "denoising/candidates.h"
#include "denoising/denoising_choice.h"
#include "denoising/denoising_parts.h"
#include "denoising/history.h"
#include "denoising/mixture_name.h"
#include "estimators/method.h"
#include "settings/settings.h"

namespace covary {

/// What the mixture minimises.
enum class DenoiseMode {
  kNone,      ///< no denoising
  kAuto,      ///< least error, the default of renders
  kBias,      ///< 4 squared bias + variance; with residual correction
  kBalanced,  ///< 2 squared bias + variance; with residual correction
  kError,     ///< least error
};

struct MeanMixture;     // mean_mixture.h
struct PairMixture;     // mean_mixture.h
struct MixedDenoising;  // below

struct MixedDenoisingOptions {
  DenoiseMode mode = DenoiseMode::kBalanced;
  bool use_oidn = true;  ///< use Open Image Denoise if it is installed
  DenoiseOptions oidn;   ///< its library; it is an error if a given path has none
  MixingHistory history;
  /// Makes the mixture of a mean elsewhere, such as on a GPU, or by calling `here`; empty:
  /// here.
  std::function<MixedDenoising(const MeanMixture&, const std::function<MixedDenoising()>& here)> mix_mean;
  /// Same for a pair.
  std::function<MixedDenoising(const PairMixture&, const std::function<MixedDenoising()>& here)> mix_pair;
};

/// A method that holds another, whose image it denoises: that of a pair that predicts its error, or the mean. For the
/// former, it needs twice the groups. For the mean, it takes one independent pass: a mixture from kMinMixedSamples
/// samples on, and the best single candidate with fewer. Throws Error(kUsage) for any other base.
Method with_denoising(const Method& base, const MixedDenoisingOptions& options);

/// Whether with_denoising() takes the method as base.
bool can_be_denoised(const Method& method);

/// What kMixture denoises, with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_mixture(Settings& options);

/// `denoise` and `oidn`, MixedDenoisingOptions as text. `is_all`: the caller has no other use for the network, so
/// `oidn` without `denoise` is an error.
void declare(Settings& settings, DenoisingChoice& choice, bool is_all = true);
constexpr const char* kNotDenoised = "without `denoise` auto, bias, balanced or error";

/// A note that Open Image Denoise is missing, and how to get it; empty if it is found or not to be used.
std::string missing_network(const DenoisingChoice& choice);

/// Result of denoise_by_mixture().
struct MixedDenoising {
  MethodImage result;
  std::vector<std::string> names;  ///< of the candidates
  std::vector<Image> candidates;   ///< made of all samples
  std::vector<Image> weights;      ///< one channel each
  Planes shares = {};              ///< CandidateSet::shares
};
/// Implements with_denoising() for any candidates. `std_error`: estimate the result's error. `layers`: denoise these
/// layers of a mean, too.
MixedDenoising denoise_by_mixture(DenoisingParts parts, const std::vector<CandidateMaker>& makers, DenoiseMode mode,
                                  bool std_error, std::span<const Layer> layers = {},
                                  const MixingHistory& history = {});

/// The smallest number of samples per pixel, in two groups or more, with which halves can compare candidates.
inline constexpr int kMinMixedSamples = 4;

/// The modes by name, "none" first.
const std::vector<std::string>& denoise_mode_names();
/// Whether it gives up error for less bias.
bool lowers_bias(DenoiseMode mode);
/// Throws Error(kUsage) for an unknown name.
DenoiseMode denoise_mode(const std::string& name);

}  // namespace covary
