// SPDX-License-Identifier: Apache-2.0
#include "sampling/light_selection.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace covary {

PowerLights::PowerLights(const Scene& scene) : emitters_(scene.emitters()) {
  if (emitters_.empty()) return;
  std::vector<LightPower> powers;
  for (const auto& emitter : emitters_) powers.push_back({luminance(emitter->power()), emitter->knows_power()});
  const std::vector<double> weights = weights_by_power(powers);
  // The table stores cumulative sums as floats, whose last digit a positive weight must reach.
  const double least = 0x1p-22 * std::accumulate(weights.begin(), weights.end(), 0.0);
  std::vector<float> table;
  for (const double weight : weights) table.push_back(static_cast<float>(weight > 0 ? std::max(weight, least) : 0));
  distribution_ = Discrete(table);
  for (size_t i = 0; i < emitters_.size(); ++i)
    pmfs_[emitters_[i].get()] += distribution_.pmf(static_cast<uint32_t>(i));
}

std::vector<double> weights_by_power(std::span<const LightPower> lights) {
  constexpr double kMin = 0.01;  // of the mean
  double sum = 0;
  for (const LightPower& light : lights) sum += light.power;
  if (!std::isfinite(sum) || !(sum > 0)) return std::vector<double>(lights.size(), 1.0);
  const double least = kMin * sum / static_cast<double>(lights.size());
  std::vector<double> weights;
  for (const LightPower& light : lights) weights.push_back(light.exact ? light.power : std::max(light.power, least));
  return weights;
}

}  // namespace covary
