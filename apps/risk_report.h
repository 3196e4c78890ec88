// SPDX-License-Identifier: Apache-2.0
// Reports on images to combine, and on the error of a denoised image: its size, its bias, and the errors that other
// images would have had.
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "combine/combine.h"
#include "combine/pair_input.h"
#include "denoising/mixed_denoising.h"
#include "estimators/estimator_result.h"
#include "risk/predicted_error.h"

namespace covary {

/// "predicted relMSE 0.0021, between 0.0016 and 0.0029 (80 %), 18 % of it squared bias; the mean of the samples has
/// 0.012, Open Image Denoise alone 0.0025 (unreliable: known to a factor of 1.8)", as far as known.
std::string prediction_text(const PredictedError& predicted, const std::optional<MeasuredRisks>& risks);

/// "4.2 %": how much of a picture is noise or blur, as a fraction of its brightness, the root of relMSE.
std::string percent_text(double relmse);

/// The predicted error in plain words: "about 4.2 % grain left (unsure: known to a factor of 3)".
struct Quality {
  std::string text;
  double relmse = 0;  ///< the error that it names
  /// `of_blocks`: predicted_blocks(), or 0.
  Quality(const PredictedError& predicted, const std::optional<MeasuredRisks>& risks, double of_blocks);
};

/// Lines on stderr: problems of the inputs and, unless `quiet`, notes. Throws Error(kInput) instead if there are
/// errors, unless `force` turns them into warnings. `work`: what the command does then, e.g. "combines".
void print_findings(const std::vector<Finding>& findings, const char* work, bool force, bool quiet);
/// Lines on stderr: the missing network, and `note`, if any.
void print_notes(const DenoisingChoice& choice, const std::string& note);
/// In place of error_lines(), for an image that nothing compares.
inline constexpr const char* kErrorOfOneRender =
    "how good: unknown, as one render does not tell its noise; a second one of another seed does\n";
inline constexpr const char* kErrorOfMerged =
    "how good: unknown, as merging left one group of samples; denoise the renders themselves, or merge films with "
    "--groups\n";
/// How good an image is and, with `verbose`, its predicted error, each with a line feed; empty if it is unknown.
std::string error_lines(const CombinedImage& combined, bool verbose);
constexpr const char* kVerboseHelp = "In the summary, also the predicted error with its interval";

/// "predicted_relmse", its bounds "predicted_relmse_low" and "_high", "predicted_relmse_reliable" and the doubt.
void add_prediction(const PredictedError& predicted, nlohmann::ordered_json& json);

/// "predicted_bias_share" and "risks"; nothing if unknown.
void add_risks(const std::optional<MeasuredRisks>& risks, nlohmann::ordered_json& json);

/// "error_sums": the basis of the interval; nothing if unknown.
void add_error_sums(const std::optional<RiskRow>& sums, nlohmann::ordered_json& json);

/// "denoiser", the network that was used, "denoiser_runs", how many images and features it denoised, and
/// "denoiser_missing": that it was missing, and how to get it.
void add_network(const std::string& network, int runs, const DenoisingChoice& choice, nlohmann::ordered_json& json);

}  // namespace covary
