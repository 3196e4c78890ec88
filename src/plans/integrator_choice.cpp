// SPDX-License-Identifier: Apache-2.0
#include "plans/integrator_choice.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "core/error.h"
#include "plans/render.h"
#include "scene/property_source.h"

namespace covary {
namespace {

/// Throws Error(kUsage) for an option that the integrator does not have.
void check_options(const std::string& integrator, const OptionValues& options) {
  const std::vector<Option> own = options_of_integrator(integrator);
  for (const auto& [name, value] : options)
    if (!find_option(own, name)) refuse_option("integrator", integrator, own, name, integrators_with_option(name));
}

/// Marks the properties of an integrator that another one replaces as known: its own or, if it is unknown, all.
void ignore_properties_of(const std::string& integrator, Parameters& parameters) {
  if (find_integrator(integrator))
    ignore_properties(parameters, options_of_integrator(integrator));
  else
    parameters.ignore_rest();
}

/// Mitsuba also accepts depths without any paths. Such images are black, which is rarely intended.
void warn_of_black(Parameters& parameters, const Settings& settings) {
  const auto depth = [&](const char* name) { return std::stoi(find_option(settings.options(), name)->default_value); };
  const int most = depth("max-depth"), least = depth("min-depth");
  if (most == 0)
    parameters.warn(
        "the image is black, because paths of max_depth 0 have no light; 1 shows lights that are seen "
        "directly, 2 direct light, and -1 is no limit");
  else if (most > 0 && least > most)
    parameters.warn(
        fmt::format("the image is black, because no path has min_depth {} edges and not more than "
                    "max_depth {}",
                    least, most));
}

}  // namespace

std::function<std::shared_ptr<SceneObject>(Parameters&)> integrator_maker(const IntegratorChoice& choice) {
  return [choice](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    const std::string& of_scene = parameters.type();
    const std::string& name = choice.name.empty() ? of_scene : choice.name;
    const IntegratorPlugin* plugin = find_integrator(name);
    if (!plugin && parameters.ignores_unknown()) {
      parameters.unknown(fmt::format("integrator '{}'", name), "", "becomes 'path'");
      plugin = find_integrator("path");
    }
    if (!plugin) {
      parameters.error(
          fmt::format("{}; --integrator path renders the scene by path tracing", unknown_integrator(name)));
      parameters.ignore_rest();
      return nullptr;
    }
    check_options(plugin->name, choice.options);
    if (plugin->name != of_scene) ignore_properties_of(of_scene, parameters);
    PropertySource source(parameters, choice.options);
    Settings settings(source);
    auto integrator = make_integrator(*plugin, settings);
    warn_of_black(parameters, settings);
    return integrator;
  };
}

const Integrator& integrator_of(const LoadedScene& scene) {
  const auto* integrator = dynamic_cast<const Integrator*>(scene.integrator.get());
  if (!integrator)
    throw Error(ErrorCode::kUsage,
                "the scene was loaded without an integrator; set LoadOptions::make_integrator, such as "
                "to integrator_maker({})");
  return *integrator;
}

const Integrator& integrator_of(const LoadedScene& scene, const RenderRequest& request) {
  return request.integrator ? *request.integrator : integrator_of(scene);
}

std::string unknown_integrator(const std::string& name) {
  if (name == "stokes") return "integrator 'stokes' is about the polarisation of light, which is not rendered here";
  const std::vector<std::string> names = integrator_names();
  return fmt::format("unknown integrator '{}'; expected {}{}", name, fmt::join(names, ", "), did_you_mean(name, names));
}

}  // namespace covary
