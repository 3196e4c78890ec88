// SPDX-License-Identifier: Apache-2.0
// One line per integrator.
#include "integrators/registry.h"

namespace covary {

std::shared_ptr<Integrator> make_auto(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_bdpt(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_controlled_path(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_depth(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_direct(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_guided_path(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_path(Settings&, const PathLengthSettings&);

std::span<const IntegratorPlugin> integrator_plugins() {
  static constexpr IntegratorPlugin kPlugins[] = {
      {"auto", make_auto},   {"bdpt", make_bdpt},     {"controlled-path", make_controlled_path},
      {"depth", make_depth}, {"direct", make_direct}, {"guided-path", make_guided_path},
      {"path", make_path},
  };
  return kPlugins;
}

const IntegratorPlugin* find_integrator(std::string_view name) {
  for (const IntegratorPlugin& plugin : integrator_plugins())
    if (name == plugin.name) return &plugin;
  return nullptr;
}

std::vector<Option> options_of_integrator(const std::string& name) {
  Settings settings;
  make_integrator(*find_integrator(name), settings);
  return settings.options();
}

std::vector<Option> options_of_integrators() {
  const std::vector<std::string> names = integrator_names();
  std::vector<std::vector<Option>> lists;
  for (const std::string& name : names) {
    lists.push_back(options_of_integrator(name));
    std::erase_if(lists.back(), [](const Option& option) { return option.level == OptionLevel::kScene; });
  }
  return merged_options(names, lists);
}

std::vector<std::string> integrator_names() {
  std::vector<std::string> names;
  for (const IntegratorPlugin& plugin : integrator_plugins()) names.emplace_back(plugin.name);
  return names;
}

std::vector<std::string> integrators_with_option(const std::string& option) {
  std::vector<std::string> names;
  for (const std::string& name : integrator_names())
    if (find_option(options_of_integrator(name), option)) names.push_back(name);
  return names;
}

std::shared_ptr<Integrator> make_integrator(const IntegratorPlugin& plugin, Settings& settings) {
  PathLengthSettings lengths;
  declare(settings, lengths);
  return plugin.make(settings, lengths);
}

}  // namespace covary
