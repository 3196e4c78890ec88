// SPDX-License-Identifier: Apache-2.0
#include "film/denoised_by.h"

#include <algorithm>

namespace covary {

std::string denoised_by(const std::map<std::string, std::string>& attributes,
                        std::span<const ExrFile::Channel> channels, const std::string& layer) {
  const auto attribute = [&](const char* name) {
    const auto it = attributes.find(name);
    return it == attributes.end() ? std::string() : it->second;
  };
  if (const std::string estimator = attribute("covary:estimator"); estimator.find("--denoise") != std::string::npos)
    return estimator;
  if (const std::string denoiser = attribute("covary:denoiser"); !denoiser.empty()) return denoiser;
  constexpr std::string_view kNoisy = "Noisy Image";
  const bool has_noisy = std::any_of(channels.begin(), channels.end(), [&](const ExrFile::Channel& c) {
    return c.name.find(kNoisy) != std::string::npos;
  });
  const bool is_picture = layer.empty() || layer == "Combined" || layer.ends_with(".Combined");
  return has_noisy && is_picture ? "by Cycles, which wrote the layer 'Noisy Image' beside it" : "";
}

}  // namespace covary
