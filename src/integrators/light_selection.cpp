// SPDX-License-Identifier: Apache-2.0
#include "integrators/light_selection.h"

#include <cmath>

namespace covary {

PowerLights::PowerLights(const Scene& scene) : emitters_(scene.emitters()) {
  if (emitters_.empty()) return;
  std::vector<float> powers;
  for (const auto& emitter : emitters_) powers.push_back(luminance(emitter->power()));
  const bool finite = std::all_of(powers.begin(), powers.end(), [](float power) { return std::isfinite(power); });
  const bool black = std::all_of(powers.begin(), powers.end(), [](float power) { return power <= 0; });
  if (!finite || black) std::fill(powers.begin(), powers.end(), 1.0f);
  distribution_ = Discrete(powers);
  for (size_t i = 0; i < emitters_.size(); ++i)
    pmfs_[emitters_[i].get()] += distribution_.pmf(static_cast<uint32_t>(i));
}

}  // namespace covary
