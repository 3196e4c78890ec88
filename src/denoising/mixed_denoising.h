// SPDX-License-Identifier: Apache-2.0
// Denoising that knows its error (ours): the image of an estimator and images with less noise and more bias
// (candidates.h), mixed at each pixel in the proportions that held-out samples find best (mixture.h).
//
// Claim: consistent where the estimator is, because the weights of candidates that are wrong vanish as samples tell so.
// Its error is measured, bias included (held_out_error.h).
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

#include "denoising/candidates.h"
#include "estimators/estimator.h"
#include "settings/settings.h"

namespace covary {

/// What the mixture minimises, from least bias to least error.
enum class DenoiseMode {
  kNone,      ///< no denoising
  kBias,      ///< squared bias counts four times as much as variance; residual feedback
  kBalanced,  ///< twice as much; residual feedback
  kError,     ///< least error
};

struct MixedDenoisingOptions {
  DenoiseMode mode = DenoiseMode::kBalanced;
  bool use_oidn = true;  ///< candidates of Open Image Denoise, where it is installed
  DenoiseOptions oidn;   ///< where it is; a library that is named and is not there is an error
};

/// The estimator's image denoised. `base` is an estimator of a pair that predicts its error. The result reads guides,
/// needs the whole image, and twice the groups. Throws Error(kUsage) for another base.
Estimator with_denoising(const Estimator& base, const MixedDenoisingOptions& options);

/// Whether an estimator can be the base.
bool can_be_denoised(const Estimator& estimator);

/// MixedDenoisingOptions by words, as options have them.
struct DenoisingChoice {
  std::string mode = "none";  ///< of denoise_mode_names()
  std::string oidn;           ///< a library or a folder of it; "": where it is found, "off": without it
  bool denoises() const { return mode != "none"; }
};
void declare(Settings& settings, DenoisingChoice& choice);

/// What with_denoising() does, with any candidates.
struct MixedDenoising {
  EstimatorResult result;
  std::vector<std::string> names;  ///< of the candidates
  std::vector<Image> candidates;   ///< made of all samples
  std::vector<Image> weights;      ///< one channel each
};
MixedDenoising denoise_by_mixture(const Estimator& base, const GroupedImage& crn, const GroupedImage& independent,
                                  const PairSettings& settings, const std::vector<CandidateMaker>& makers,
                                  DenoiseMode mode);

/// The modes by name, "none" first.
const std::vector<std::string>& denoise_mode_names();
/// Throws Error(kUsage) for a name that there is not.
DenoiseMode denoise_mode(const std::string& name);

}  // namespace covary
