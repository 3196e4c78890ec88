// SPDX-License-Identifier: Apache-2.0
#include "combine/result_file.h"

namespace covary {

void write_result(const std::string& path, const ImagePlace& place,
                  const std::map<std::string, std::string>& attributes, EstimatorResult& result,
                  std::map<std::string, Image>& aovs) {
  std::vector<ExrPlane> planes;
  add_image_planes("", result.estimate, planes);
  if (!result.std_error.data.empty()) add_image_planes("StdError", result.std_error, planes);
  if (!result.bias.data.empty()) add_image_planes("Bias", result.bias, planes);
  for (auto& [name, image] : aovs) add_image_planes(name, image, planes);
  write_exr(path, place, attributes, planes);
}

}  // namespace covary
