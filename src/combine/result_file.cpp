// SPDX-License-Identifier: Apache-2.0
#include "combine/result_file.h"

#include <fmt/format.h>

#include <limits>
#include <optional>

#include "film/film_file.h"

namespace covary {

std::map<std::string, std::string> prediction_attributes(const std::optional<PredictedError>& predicted) {
  std::map<std::string, std::string> attributes;
  if (!predicted) return attributes;
  attributes[film_key::kPredicted] = fmt::format("{:.4g}", predicted->relmse);
  if (const std::optional<PredictedBounds>& bounds = predicted->bounds)
    attributes[film_key::kPredictedBounds] = fmt::format("{:.4g} {:.4g}", bounds->low, bounds->high);
  return attributes;
}

void write_result(const std::string& path, const ImagePlace& place,
                  const std::map<std::string, std::string>& attributes, EstimatorResult& result,
                  std::map<std::string, Image>& aovs) {
  std::vector<ExrPlane> planes;
  add_image_planes("", result.estimate, planes);
  if (!result.std_error.data.empty()) add_image_planes("StdError", result.std_error, planes);
  if (!result.bias.data.empty()) add_image_planes("Bias", result.bias, planes);
  for (auto& [name, image] : aovs) add_image_planes(name, image, planes);
  std::map<std::string, std::string> all = attributes;
  const auto predicted = predicted_error(result, std::numeric_limits<double>::infinity(), 0);
  for (const auto& [key, value] : prediction_attributes(predicted)) all["covary:" + key] = value;
  write_exr(path, place, all, planes);
}

}  // namespace covary
