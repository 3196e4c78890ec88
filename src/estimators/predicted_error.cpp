// SPDX-License-Identifier: Apache-2.0
#include "estimators/predicted_error.h"

#include <cmath>

#include "core/error.h"

namespace covary {

double predicted_relmse(const EstimatorResult& result) {
  const Image &f = result.estimate, &error = result.std_error;
  if (error.data.empty())
    throw Error(ErrorCode::kUsage, "predicted_relmse: the result has no standard error; set std_error in the options");
  double total = 0;
  size_t n_pixels = 0;
  for (size_t i = 0; i < f.data.size(); i += 3) {
    double sum = 0, squares = 0;
    for (size_t c = 0; c < 3; ++c) {
      sum += f.data[i + c];
      squares += static_cast<double>(error.data[i + c]) * error.data[i + c];
    }
    const double relative = squares / 3 / (sum * sum / 9 + 0.01);
    if (!std::isfinite(relative)) continue;
    total += relative;
    ++n_pixels;
  }
  return n_pixels ? total / static_cast<double>(n_pixels) : 0.0;
}

}  // namespace covary
