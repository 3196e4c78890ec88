// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_weights.h"

#include <algorithm>
#include <cmath>

namespace covary {

std::vector<double> weights_by_power(std::span<const LightPower> lights) {
  constexpr double kLeast = 0.01;  // of the mean
  double sum = 0;
  for (const LightPower& light : lights) sum += light.power;
  if (!std::isfinite(sum) || !(sum > 0)) return std::vector<double>(lights.size(), 1.0);
  const double least = kLeast * sum / static_cast<double>(lights.size());
  std::vector<double> weights;
  for (const LightPower& light : lights) weights.push_back(light.exact ? light.power : std::max(light.power, least));
  return weights;
}

}  // namespace covary
