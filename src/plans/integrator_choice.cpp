// SPDX-License-Identifier: Apache-2.0
#include "plans/integrator_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "core/error.h"
#include "scene/property_source.h"

namespace covary {
namespace {

void check_belong(const std::string& integrator, const OptionValues& options) {
  const std::vector<Option> own = options_of_integrator(integrator);
  for (const auto& [name, value] : options) {
    if (find_option(own, name)) continue;
    const std::vector<std::string> owners = integrators_with_option(name);
    if (!owners.empty())
      throw Error(ErrorCode::kUsage, fmt::format("--{} is an option of --integrator {}, not of {}", name,
                                                 fmt::join(owners, ", "), integrator));
    std::vector<std::string> names;
    for (const Option& option : own) names.push_back(option.name);
    throw Error(ErrorCode::kUsage,
                fmt::format("--{} is not an option of any integrator{}", name, did_you_mean(name, names)));
  }
}

}  // namespace

std::function<std::shared_ptr<SceneObject>(Parameters&)> integrator_maker(const IntegratorChoice& choice) {
  return [choice](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    const std::string& of_scene = parameters.type();
    const std::string& name = choice.name.empty() ? of_scene : choice.name;
    const IntegratorPlugin* plugin = find_integrator(name);
    if (!plugin) {
      parameters.error(unknown_integrator(name));
      return nullptr;
    }
    check_belong(name, choice.options);
    if (name != of_scene && find_integrator(of_scene)) ignore_properties(parameters, options_of_integrator(of_scene));
    PropertySource source(parameters, choice.options);
    Settings settings(source);
    return make_integrator(*plugin, settings);
  };
}

const Integrator& integrator_of(const LoadedScene& scene) {
  const auto* integrator = dynamic_cast<const Integrator*>(scene.integrator.get());
  COVARY_CHECK(integrator, "the scene was loaded with an integrator");
  return *integrator;
}

std::string unknown_integrator(const std::string& name) {
  const std::vector<std::string> names = integrator_names();
  return fmt::format("unknown integrator '{}'{}; supported: {}", name, did_you_mean(name, names),
                     fmt::join(names, ", "));
}

}  // namespace covary
