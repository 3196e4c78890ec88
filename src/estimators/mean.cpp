// SPDX-License-Identifier: Apache-2.0
#include "estimators/mean.h"

#include <cmath>

namespace covary {

EstimatorResult mean_of_groups(const GroupedImage& image) {
  const int T = image.groups;
  EstimatorResult result;
  result.estimate = Image(image.width, image.height, 3);
  if (T > 1) result.std_error = Image(image.width, image.height, 3);
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) {
        const float* groups = image.pixel(x, y) + c;
        double sum = 0, squares = 0;
        for (int t = 0; t < T; ++t) sum += groups[3 * t];
        for (int t = 0; t < T; ++t) squares += std::pow(groups[3 * t] - sum / T, 2);
        result.estimate.pixel(x, y)[c] = static_cast<float>(sum / T);
        if (T > 1) result.std_error.pixel(x, y)[c] = static_cast<float>(std::sqrt(squares / (T - 1) / T));
      }
  return result;
}

}  // namespace covary
