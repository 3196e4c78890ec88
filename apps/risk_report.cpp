// SPDX-License-Identifier: Apache-2.0
#include "risk_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "method_options.h"
#include "risk/error_interval.h"

namespace covary {
namespace {

/// The predicted error is mostly that of few pixels if it is more than so many times that of nearly all blocks.
constexpr double kManyTimes = 4;

/// ", 18 % of it squared bias; the mean of the samples has 0.012, Open Image Denoise alone 0.0025"
std::string risks_text(const MeasuredRisks& risks) {
  std::string text = fmt::format(", {:.0f} % of it squared bias", 100 * risks.bias_share);
  const char* before = "; ";
  for (size_t i = 0; i < risks.images.size(); ++i) {
    const auto& [name, relmse] = risks.images[i];
    const bool of_independent = name == "oidn-independent";
    if (i > 0 && name != "oidn" && !of_independent) continue;
    text += fmt::format("{}{} {:.3g}", before,
                        of_independent   ? "Open Image Denoise of the independent samples"
                        : i > 0          ? "Open Image Denoise alone"
                        : name == "mean" ? "the mean of the samples has"
                                         : name + " has",
                        relmse);
    before = ", ";
  }
  return text;
}

}  // namespace

std::string prediction_text(const PredictedError& predicted, const std::optional<MeasuredRisks>& risks) {
  const auto& [relmse, bounds, doubt] = predicted;
  std::string text = fmt::format("predicted relMSE {:.3g}", relmse);
  if (bounds) text += fmt::format(", between {:.2g} and {:.2g} ({} %)", bounds->low, bounds->high, kIntervalPercent);
  if (risks) text += risks_text(*risks);
  if (!doubt.empty()) text += fmt::format(" (unreliable: {})", doubt);
  return text;
}

std::string percent_text(double relmse) { return fmt::format("{:.2g} %", 100 * std::sqrt(std::max(0.0, relmse))); }

Quality::Quality(const PredictedError& predicted, const std::optional<MeasuredRisks>& risks, double of_blocks) {
  const bool blurred = risks && risks->bias_share > 0.5;
  // A few pixels that may be fireflies would say nothing about the rest.
  const bool by_few = predicted.relmse > kManyTimes * of_blocks && of_blocks > 0;
  relmse = by_few ? of_blocks : predicted.relmse;
  text = fmt::format("{} {} {} left{}", by_few ? "at most" : "about", percent_text(relmse), blurred ? "error" : "grain",
                     by_few ? " in 95 % of the picture, more in few bright pixels" : "");
  constexpr size_t kShort = 50;
  const std::string& doubt = predicted.doubt;
  if (!doubt.empty())
    text += fmt::format(" (unsure: {})", doubt.size() <= kShort ? doubt : "`covary info` of it says why");
}

void add_prediction(const PredictedError& predicted, nlohmann::ordered_json& json) {
  const auto& [relmse, bounds, doubt] = predicted;
  json["predicted_relmse"] = relmse;
  if (bounds) json["predicted_relmse_low"] = bounds->low, json["predicted_relmse_high"] = bounds->high;
  json["predicted_relmse_reliable"] = doubt.empty();
  if (!doubt.empty()) json["predicted_relmse_doubt"] = doubt;
}

void print_findings(const std::vector<Finding>& findings, const char* work, bool force, bool quiet) {
  if (const std::string errors = errors_text(findings); !errors.empty() && !force)
    throw Error(ErrorCode::kInput, fmt::format("the inputs do not fit: {} (--force {} them anyway)", errors, work));
  for (const Finding& f : findings) {
    const bool note = f.severity == Finding::Severity::kNote;
    if (!note || !quiet) fmt::print(stderr, "{}: {}\n", note ? "note" : "warning", as_options(f.text));
  }
}

void print_notes(const DenoisingChoice& choice, const std::string& note) {
  for (const std::string& text : {missing_network(choice), note})
    if (!text.empty()) fmt::print(stderr, "note: {}\n", as_options(text));
}

std::string error_lines(const CombinedImage& combined, bool verbose) {
  if (!combined.predicted) return "";
  const auto& risks = combined.image.risks;
  const double of_blocks = combined.image.std_error.data.empty() ? 0 : predicted_blocks(combined.image);
  std::string lines = "how good: " + Quality(*combined.predicted, risks, of_blocks).text + "\n";
  if (verbose) lines += prediction_text(*combined.predicted, risks) + "\n";
  return lines;
}

void add_risks(const std::optional<MeasuredRisks>& risks, nlohmann::ordered_json& json) {
  if (!risks) return;
  json["predicted_bias_share"] = risks->bias_share;
  json["held_out_relmse"] = risks->held_out;
  for (const auto& [name, relmse] : risks->images) json["risks"][name] = relmse;
}

void add_error_sums(const std::optional<RiskRow>& sums, nlohmann::ordered_json& json) {
  if (!sums) return;
  for (const auto& [name, sum] : kRiskSums) json["error_sums"][name] = (*sums).*sum;
}

void add_network(const std::string& network, int runs, const DenoisingChoice& choice, nlohmann::ordered_json& json) {
  if (!network.empty()) json["denoiser"] = network, json["denoiser_runs"] = runs;
  if (const std::string text = missing_network(choice); !text.empty()) json["denoiser_missing"] = as_options(text);
}

}  // namespace covary
