// SPDX-License-Identifier: Apache-2.0
#include "plans/light_plan.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "core/error.h"
#include "film/splat_layer.h"
#include "passes/light_pass.h"
#include "plans/budget.h"
#include "plans/integrator_choice.h"

namespace covary {
namespace {

/// A single group has no standard error; a film that is added to the image group by group has the camera's number of
/// groups.
int with_error(const Plan& plan, int groups) {
  constexpr int kDefault = 12;
  return groups == 1 && plan.method->predicts_error && !plan.makes_film() ? kDefault : groups;
}

}  // namespace

std::span<const Pass> camera_passes(std::span<const Pass> passes) {
  return passes.first(passes.size() - (light_pass(passes) ? 1 : 0));
}

const Pass* light_pass(std::span<const Pass> passes) {
  return !passes.empty() && passes.back().plan.light ? &passes.back() : nullptr;
}

bool has_light_pass(const LoadedScene& scene, const Plan& plan, const RenderRequest& request) {
  if (!scene.integrator) return false;
  const LightTracingIntegrator* tracer = integrator_of(scene, request).light_tracing();
  return tracer && tracer->wants_light_pass(plan.has_crn_pass);
}

std::shared_ptr<Integrator> prepared_integrator(const LoadedScene& scene, const Plan& plan,
                                                const RenderRequest& request) {
  std::shared_ptr<Integrator> integrator = integrator_of(scene, request).clone();
  LightTracingIntegrator* tracer = integrator->light_tracing();
  require_sees_media(*integrator, *scene.scene);
  integrator->prepare(*scene.scene);
  if (tracer) {
    const CropWindow window = window_of(scene, request);
    tracer->fix_light_tracing(static_cast<uint64_t>(window.width) * static_cast<uint64_t>(window.height),
                              plan.has_crn_pass);
  }
  return integrator;
}

PassPlan light_pass_plan(const Plan& plan, std::span<const PassPlan> passes) {
  PassPlan light;
  light.name = "light";
  light.light = true;
  for (const PassPlan& pass : passes) light.groups = std::max(light.groups, pass.groups);
  light.groups = with_error(plan, light.groups);
  return light;
}

int light_groups(const Plan& plan, std::span<const Pass> passes) {
  int most = 1;
  for (const Pass& pass : passes) most = std::max(most, pass.film.groups());
  return with_error(plan, most);
}

void set_light_target(const Integrator& integrator, std::span<const Pass> cameras, Pass& light) {
  const LightTracingIntegrator* tracer = light_tracer(integrator);
  COVARY_CHECK(tracer, "an integrator that traces light");
  double spp = 0;
  for (const Pass& pass : cameras) spp += pass.settings.spp.mean();
  const double groups = light.film.groups();
  const double most = std::floor(static_cast<double>(std::numeric_limits<uint32_t>::max()) / groups);
  const double per_group = spp * tracer->light_paths_per_spp() / kBundlePaths / groups;
  light.wanted = groups * std::max(1.0, std::round(per_group));
  light.settings.spp = static_cast<uint32_t>(std::min(light.wanted, groups * most));
}

bool denoises_light(const Plan& plan, const Film& camera, const Film& light) {
  return plan.method->one_pass() && !plan.makes_film() && !plan.adds_films && camera.groups() == light.groups();
}

Film sum_of_films(const Film& camera, const Film& light) {
  if (camera.groups() != light.groups())
    throw Error(ErrorCode::kInput, "the films of camera and light differ in their number of groups: " +
                                       std::to_string(camera.groups()) + " and " + std::to_string(light.groups()));
  Film sum = camera;
  std::transform(sum.data().begin(), sum.data().end(), light.data().begin(), sum.data().begin(), std::plus<>());
  sum.attributes[film_key::kLight] = "added";
  return sum;
}

}  // namespace covary
