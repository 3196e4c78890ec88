// SPDX-License-Identifier: Apache-2.0
#include "plans/pixel_importance.h"

#include <algorithm>
#include <cmath>

#include "filters/joint_bilateral.h"
#include "integrators/aov.h"
#include "passes/training.h"

namespace covary {

std::vector<Spectrum> pixel_importance(const Scene& scene, const FilterSettings& filter, const Film& film,
                                       const std::optional<DenoiseOptions>& oidn, const std::atomic<bool>* stop) {
  constexpr float kSmallest = 0.01f;  // as in relMSE
  constexpr uint32_t kGuideSamples = 2;
  PassSettings settings;
  settings.pass = kTrainingPass, settings.filter = filter;
  Film guides(film.frame_width(), film.frame_height(), film.crop(), 1);
  render_aovs(scene, settings, kGuideSamples, guides, stop);
  if (!guides.aovs.contains("N")) return {};
  const Image &albedo = guides.aovs.at("Albedo"), &normal = guides.aovs.at("N");
  const Image value =
      oidn ? denoise(film.mean_image(), &albedo, &normal, *oidn) : joint_bilateral(film.mean_image(), albedo, normal);
  std::vector<Spectrum> importance;
  for (int y = 0; y < value.height; ++y)
    for (int x = 0; x < value.width; ++x) {
      Spectrum weight;
      for (int c = 0; c < 3; ++c) weight[c] = 1 / std::sqrt(sqr(std::max(value.pixel(x, y)[c], 0.0f)) + kSmallest);
      importance.push_back(weight);
    }
  return importance;
}

}  // namespace covary
