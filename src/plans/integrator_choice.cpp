// SPDX-License-Identifier: Apache-2.0
#include "plans/integrator_choice.h"

#include <fmt/format.h>

#include <vector>

#include "core/error.h"
#include "integrators/controlled_path.h"
#include "integrators/guided_path.h"
#include "integrators/light_pass.h"

namespace covary {

std::function<std::shared_ptr<SceneObject>(Parameters&)> integrator_maker(const IntegratorChoice& choice) {
  return [choice](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    PathLengthSettings lengths = PathLengthSettings::from(parameters);
    if (choice.min_depth) lengths.min_depth = *choice.min_depth;
    if (choice.max_depth)
      lengths.max_depth = *choice.max_depth < 0 ? PathLengthSettings::kUnlimited : *choice.max_depth;
    const IntegratorPlugin* plugin = find_integrator(choice.name.empty() ? parameters.type() : choice.name);
    if (!plugin) {
      parameters.error(unknown_integrator(parameters.type()));
      return nullptr;
    }
    if (choice.tolerates_light) LightTracingSettings::from(parameters), parameters.get_string("heuristic", "");
    const std::shared_ptr<Integrator> integrator = plugin->make(parameters, lengths);
    if (auto* controlled = dynamic_cast<ControlledPath*>(integrator.get()); controlled && choice.control)
      controlled->change(*choice.control);
    if (auto* guided = dynamic_cast<GuidedPath*>(integrator.get())) {
      if (choice.guide) guided->change(*choice.guide);
      if (choice.control) {
        GuideOptions control;
        control.control = choice.control->kind, control.control_train_spp = choice.control->train_spp;
        guided->change(control);
      }
    }
    return integrator;
  };
}

const IntegratorPlugin* find_integrator(const std::string& name) {
  for (const IntegratorPlugin& plugin : integrator_plugins())
    if (name == plugin.name) return &plugin;
  return nullptr;
}

std::string unknown_integrator(const std::string& name) {
  std::vector<std::string> names;
  for (const IntegratorPlugin& plugin : integrator_plugins()) names.emplace_back(plugin.name);
  return fmt::format("unknown integrator '{}'{}; supported: {}", name, did_you_mean(name, names),
                     fmt::join(names, ", "));
}

}  // namespace covary
