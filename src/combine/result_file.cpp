// SPDX-License-Identifier: Apache-2.0
#include "combine/result_file.h"

#include <fmt/format.h>

#include <optional>

#include "risk/predicted_error.h"

namespace covary {

void write_result(const std::string& path, const ImagePlace& place,
                  const std::map<std::string, std::string>& attributes, EstimatorResult& result,
                  std::map<std::string, Image>& aovs) {
  std::vector<ExrPlane> planes;
  add_image_planes("", result.estimate, planes);
  if (!result.std_error.data.empty()) add_image_planes("StdError", result.std_error, planes);
  if (!result.bias.data.empty()) add_image_planes("Bias", result.bias, planes);
  for (auto& [name, image] : aovs) add_image_planes(name, image, planes);
  std::map<std::string, std::string> all = attributes;
  if (!result.std_error.data.empty()) {
    const double predicted = predicted_relmse(result);
    all["covary:predicted_relmse"] = fmt::format("{:.4g}", predicted);
    if (const std::optional<PredictedBounds> bounds = predicted_bounds(result, predicted))
      all["covary:predicted_relmse_80"] = fmt::format("{:.4g} {:.4g}", bounds->low, bounds->high);
  }
  write_exr(path, place, all, planes);
}

}  // namespace covary
