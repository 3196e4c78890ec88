// SPDX-License-Identifier: Apache-2.0
#include "combine/light_film.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <vector>

#include "core/error.h"
#include "estimators/mean.h"

namespace covary {

void add_light(const GroupedImage& light, EstimatorResult& result, int first_row) {
  const EstimatorResult mean = mean_of_groups(light);
  const auto add = [first_row](const Image& from, Image& to, const auto& sum) {
    COVARY_CHECK(from.width == to.width && first_row + from.height <= to.height, "rows of the image");
    float* const row = to.pixel(0, first_row);
    std::transform(from.data.begin(), from.data.end(), row, row, sum);
  };
  add(mean.estimate, result.estimate, std::plus<>());
  if (result.std_error.data.empty()) return;
  if (light.groups < 2)
    throw Error(ErrorCode::kInput, "the standard error of a light film can only be measured with 2 or more groups");
  add(mean.std_error, result.std_error, [](float a, float b) { return std::sqrt(a * a + b * b); });
}

GroupedSource with_light(const GroupedSource& samples, const GroupedSource& light) {
  COVARY_CHECK(samples.groups == light.groups, "as many groups");
  GroupedSource result = samples;
  result.rows = [samples, light, data = std::make_shared<std::vector<float>>()](int first, int n) {
    GroupedImage image = samples.rows(first, n);
    const GroupedImage added = light.rows(first, n);
    data->resize(static_cast<size_t>(image.pixel(0, n) - image.data));
    std::transform(image.data, image.pixel(0, n), added.data, data->begin(), std::plus<>());
    image.data = data->data();
    return image;
  };
  return result;
}

}  // namespace covary
