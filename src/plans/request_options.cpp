// SPDX-License-Identifier: Apache-2.0
#include "plans/request_options.h"

#include <fmt/format.h>

#include "core/error.h"
#include "integrators/training.h"
#include "plans/integrator_choice.h"

namespace covary {

FilterSettings filter_named(const std::string& name) {
  if (name == "box") return {FilterKind::kBox, 0.5f, 0};
  if (name == "tent") return {FilterKind::kTent, 1.0f, 0};
  if (name == "gaussian") return {FilterKind::kGaussian, 2.0f, 0.5f};
  throw Error(ErrorCode::kUsage, fmt::format("filter '{}': expected one of box, tent, gaussian", name));
}

CrnPart crn_part_named(const std::string& name) {
  if (name == "both") return CrnPart::kBoth;
  if (name == "camera") return CrnPart::kCamera;
  if (name == "light") return CrnPart::kLight;
  throw Error(ErrorCode::kUsage, fmt::format("CRN part '{}': expected one of both, camera, light", name));
}

Sampler sampler_named(const std::string& name) {
  if (name == "independent") return Sampler::kIndependent;
  if (name == "sobol") return Sampler::kSobol;
  throw Error(ErrorCode::kUsage, fmt::format("sampler '{}': expected one of independent, sobol", name));
}

void take_training(const LoadedScene& scene, RenderRequest& request) {
  const LearningIntegrator* learning = integrator_of(scene).learning();
  const uint32_t training = learning ? learning->training_spp() : 0;
  const bool open_ended = request.seconds > 0 || request.until > 0;
  if (training == 0 || (!request.spp && open_ended)) return;
  const uint32_t all = request.spp.value_or(static_cast<uint32_t>(scene.spp));
  if (all <= training)
    throw Error(ErrorCode::kUsage, fmt::format("{} samples per pixel, of which the training takes {}, leave none for "
                                               "the image; use a larger --spp or a shorter training "
                                               "(--cv-train, --guide-train)",
                                               all, training));
  request.spp = all - training;
}

}  // namespace covary
