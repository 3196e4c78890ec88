// SPDX-License-Identifier: Apache-2.0
#include "risk_report.h"

#include <fmt/format.h>

#include "settings/option_names.h"

namespace covary {

std::string risks_text(double predicted, const MeasuredRisks& risks) {
  std::string text =
      fmt::format("predicted relMSE {:.3g}, {:.0f} % of it squared bias", predicted, 100 * risks.bias_share);
  const char* before = "; ";
  for (size_t i = 0; i < risks.images.size(); ++i) {
    const auto& [name, relmse] = risks.images[i];
    if (i > 0 && name != "oidn") continue;
    text += fmt::format("{}{} {:.3g}", before,
                        i > 0            ? "Open Image Denoise alone"
                        : name == "mean" ? "the mean of the samples has"
                                         : name + " has",
                        relmse);
    before = ", ";
  }
  return text;
}

void print_risks(const EstimatorResult& image, std::optional<double> predicted, const DenoisingChoice& choice) {
  for (const std::string& note : {missing_network(choice), image.note})
    if (!note.empty()) fmt::print(stderr, "note: {}\n", as_flags(note));
  if (predicted && image.risks) fmt::print(stderr, "{}\n", risks_text(*predicted, *image.risks));
}

void add_risks(const std::optional<MeasuredRisks>& risks, nlohmann::ordered_json& json) {
  if (!risks) return;
  json["predicted_bias_share"] = risks->bias_share;
  for (const auto& [name, relmse] : risks->images) json["risks"][name] = relmse;
}

void add_network(const std::string& network, const DenoisingChoice& choice, nlohmann::ordered_json& json) {
  if (!network.empty()) json["denoiser"] = network;
  if (const std::string text = missing_network(choice); !text.empty()) json["denoiser_missing"] = as_flags(text);
}

}  // namespace covary
