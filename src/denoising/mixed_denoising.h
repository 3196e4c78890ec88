// SPDX-License-Identifier: Apache-2.0
// Denoising that knows its error (ours): the image of an estimator and images with less noise and more bias
// (candidates.h), mixed at each pixel in the proportions that held-out samples find best (mixture.h). The estimator is
// one of two passes, or the mean of a single one.
//
// Claim: consistent where the estimator is, because the weights of candidates that are wrong vanish as samples tell so.
// Its error is measured, bias included (held_out_error.h).
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
  kAuto,      ///< what leaves the least error, the default of renders
  kBias,      ///< squared bias counts four times as much as variance; residual correction
  kBalanced,  ///< twice as much; residual correction
  kError,     ///< least error
};

/// Of a frame of moving pictures, mixed in where there are samples enough for a mixture; layers have no part in it.
struct MixingHistory {
  std::shared_ptr<const History> before;  ///< of the frame before; or null
  bool keep_samples = false;              ///< EstimatorResult::kept_samples, of a mean denoised by a network
};

struct MixedDenoisingOptions {
  DenoiseMode mode = DenoiseMode::kBalanced;
  bool use_oidn = true;  ///< candidates of Open Image Denoise, where it is installed
  DenoiseOptions oidn;   ///< where it is; a library that is named and is not there is an error
  MixingHistory history;
};

/// The estimator's image denoised. `base` is an estimator of a pair that predicts its error, and the result needs twice
/// its groups; or the mean, and the result is one of a single pass (EstimatorPasses::kIndependent), mixed where there
/// are kFewestMixedSamples, and the best candidate where there are fewer. It reads guides and needs the whole image.
/// Throws Error(kUsage) for another base.
Estimator with_denoising(const Estimator& base, const MixedDenoisingOptions& options);

/// Whether an estimator can be the base.
bool can_be_denoised(const Estimator& estimator);

/// MixedDenoisingOptions by words, as options have them.
struct DenoisingChoice {
  std::string mode = "none";  ///< of denoise_mode_names()
  std::string oidn;           ///< a library or a folder of it; "": where it is found, "off": without it
  MixingHistory history;      ///< MixedDenoisingOptions::history, which no word says
  bool denoises() const { return mode != "none"; }
  bool uses_oidn() const { return denoises() && oidn != "off"; }
};
/// `is_all`: nothing else of the caller's is done by Open Image Denoise, so that `oidn` is an error without `denoise`.
void declare(Settings& settings, DenoisingChoice& choice, bool is_all = true);
constexpr const char* kNotDenoised = "without `denoise` auto, bias, balanced or error";

/// What is to be said where Open Image Denoise would take part and is not there: that it is missing, and how to get it.
/// Empty where it is there, or not wanted.
std::string missing_network(const DenoisingChoice& choice);

/// What with_denoising() does, with any candidates.
struct MixedDenoising {
  EstimatorResult result;
  std::vector<std::string> names;  ///< of the candidates
  std::vector<Image> candidates;   ///< made of all samples
  std::vector<Image> weights;      ///< one channel each
};
/// `std_error`: with the error of the result. `layers`: of a mean; its result has them, too.
MixedDenoising denoise_by_mixture(DenoisingParts parts, const std::vector<CandidateMaker>& makers, DenoiseMode mode,
                                  bool std_error, std::span<const Layer> layers = {},
                                  const MixingHistory& history = {});

/// Samples per pixel, in two groups or more, whose halves can judge candidates.
inline constexpr int kFewestMixedSamples = 4;

/// The modes by name, "none" first.
const std::vector<std::string>& denoise_mode_names();
/// Throws Error(kUsage) for a name that there is not.
DenoiseMode denoise_mode(const std::string& name);

}  // namespace covary
