// SPDX-License-Identifier: Apache-2.0
#include "plans/render.h"

#include <fmt/format.h>

#include <algorithm>

#include "combine/registry.h"
#include "core/error.h"
#include "core/processor_time.h"
#include "passes/sample_parts.h"
#include "plans/budget.h"
#include "plans/integrator_choice.h"
#include "plans/integrator_trial.h"
#include "plans/light_plan.h"
#include "plans/plan_run.h"
#include "plans/result_files.h"

namespace covary {
namespace {

void check_light_groups(const LoadedScene& scene) {
  constexpr size_t kMax = 32;
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  const std::vector<std::string> groups = light_groups(*scene.scene);
  if (groups.empty()) usage("`layers` light-groups: no light of the scene has an id, by which it belongs to a group");
  if (groups.size() > kMax)
    usage(fmt::format("`layers` light-groups: the lights have {} ids; at most {} are distinguished", groups.size(),
                      kMax));
  if (!integrator_of(scene).by_light(groups))
    usage("`layers` light-groups needs an integrator that separates lights: path");
}

void check(const LoadedScene& scene, const Plan& plan, const RenderRequest& request) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  if (!plan.method) usage("the plan is empty; plan_of() makes one for a method");
  check_output(request.output);
  if (request.spp && (*request.spp < 1 || *request.spp > kMaxBudget))
    usage(fmt::format("{} samples per pixel; expected 1 to {}", *request.spp, kMaxBudget));
  if (plan.method->pixel_pass() && (request.seconds > 0 || request.until > 0))
    usage(plan.method->name + " must know the number of samples in advance, so time and error limits are impossible");
  if (request.path_lengths && !integrator_of(scene).longest_path())
    usage("an image for each path length needs an integrator that supports it, such as controlled-path");
  if (request.splits_layers() && !plan.method->splits_layers())
    usage(fmt::format("{} makes no `layers`; `estimator` {} does, denoised or not", plan.method->name, kNoEstimator));
  if (request.light_groups) check_light_groups(scene);
  if (request.layers && !integrator_of(scene).of_direct_light())
    usage("`layers` direct needs an integrator that separates direct from indirect light: path");
  if (request.until > 0 && (request.films_only || !plan.method->predicts_error))
    usage((request.films_only ? "a render of films alone" : plan.method->name) + " does not estimate its error");
}

}  // namespace

const char* name_of(RenderStage stage, const char* estimating) {
  switch (stage) {
    case RenderStage::kTrial:
      return "short trials";
    case RenderStage::kTraining:
      return "training";
    case RenderStage::kAuxiliary:
      return "auxiliary images";
    case RenderStage::kRendering:
      return "samples";
    case RenderStage::kEstimating:
      return estimating;
    case RenderStage::kWriting:
      return "writing";
  }
  throw Error(ErrorCode::kInternal, "unknown stage of a render");
}

const Pass& PlanState::pass(const std::string& name, uint32_t number) const {
  for (const Pass& pass : passes)
    if (pass.plan.name == name && pass.plan.number == number) return pass;
  throw Error(ErrorCode::kInternal, fmt::format("no pass {} {} has begun", name, number));
}

Image RenderResult::picture() const { return image.estimate.data.empty() ? preview_of(passes) : image.estimate; }

Features features_among(const std::map<std::string, Image>& aovs) {
  Features features;
  for (size_t i = 0; i < feature::kCount; ++i)
    if (const auto found = aovs.find(kAuxiliaryFeatures[i].layer); found != aovs.end())
      features.*kImagesOfFeatures[i] = &found->second;
  features.clean = true;
  return features;
}

Sampler sampler_of(const LoadedScene& scene, const RenderRequest& request) {
  const bool is_independent = scene.sampler_type.empty() || scene.sampler_type == "independent";
  return request.sampler.value_or(is_independent ? Sampler::kIndependent : Sampler::kSobol);
}

RenderResult render(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                    const RenderCallbacks& callbacks) {
  check(scene, plan, request);
  if (callbacks.stage && !integrator_of(scene, request).choices().empty()) callbacks.stage(RenderStage::kTrial);
  const double before = processor_seconds();
  RequestOfChoice of = request_of_choice(scene, request, callbacks.stop);
  RenderResult result = PlanRun(scene, plan, of.request, callbacks).run();
  result.seconds.trial += of.seconds;
  result.seconds.processor += processor_seconds() - before;
  if (of.trials.empty()) return result;
  result.trials = std::move(of.trials);
  result.chosen = registered_name(*of.request.integrator);
  return result;
}

Image preview_of(std::span<const Pass> passes) {
  if (passes.empty()) return {};
  const std::span<const Pass> cameras = camera_passes(passes);
  const Pass* light = light_pass(passes);
  Image image = cameras[0].film.mean_image();
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x) {
      double samples = cameras[0].film.count(x, y);
      for (const Pass& pass : cameras.subspan(1)) {
        const Spectrum next = pass.film.mean(x, y);
        samples += pass.film.count(x, y);
        const auto part = static_cast<float>(pass.film.count(x, y) / std::max(samples, 1.0));
        for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] += part * (next[c] - image.pixel(x, y)[c]);
      }
      const Spectrum splats = light ? light->film.mean(x, y) : Spectrum(0);
      for (int c = 0; c < 3; ++c) image.pixel(x, y)[c] += splats[c];
    }
  return image;
}

}  // namespace covary
