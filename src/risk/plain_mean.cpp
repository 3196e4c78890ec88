// SPDX-License-Identifier: Apache-2.0
#include "risk/plain_mean.h"

#include "estimators/mean.h"
#include "risk/image_risk.h"

namespace covary {
namespace {

MethodImage plain_mean(const GroupedImage& image, const MethodSettings& settings) {
  MethodImage mean = mean_of_groups(image);
  if (settings.held_out) add_risk_of_mean(image, mean);
  for (const Layer& layer : settings.layers) mean.layers.push_back(mean_of_groups(layer.image).estimate);
  return mean;
}

}  // namespace

Method make_none(Settings& parameters) {
  constexpr double kMomentsAndMask = 7 * sizeof(float);  // per pixel, for the error
  Method method;
  method.name = method.text = kMeanName;
  method.summary = "the mean";
  method.passes = OnePass{.image = plain_mean, .is_mean = true};
  AdaptiveSampling standard;
  standard.counts.first_pass_counts = false;
  method.adaptive = ask_for_adaptive(
      parameters, standard, "A first pass decides how many samples each pixel gets; if denoised, it is averaged in");
  method.predicts_error = true;
  method.memory.of_halves = kMomentsAndMask, method.memory.groups_for_halves = 2;
  return method;
}

}  // namespace covary
