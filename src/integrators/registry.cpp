// SPDX-License-Identifier: Apache-2.0
// One line per integrator.
#include "integrators/integrator.h"

#include "core/error.h"

namespace covary {

std::shared_ptr<Integrator> make_bdpt(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_controlled_path(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_depth(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_direct(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_guided_path(Settings&, const PathLengthSettings&);
std::shared_ptr<Integrator> make_path(Settings&, const PathLengthSettings&);

std::span<const IntegratorPlugin> integrator_plugins() {
  static constexpr IntegratorPlugin kPlugins[] = {
      {"bdpt", make_bdpt},     {"controlled-path", make_controlled_path}, {"depth", make_depth},
      {"direct", make_direct}, {"guided-path", make_guided_path},         {"path", make_path},
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
  for (const std::string& name : names) lists.push_back(options_of_integrator(name));
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

void require_sees_media(const Integrator& integrator, const Scene& scene) {
  if (!scene.has_media() || integrator.sees_media()) return;
  const std::string text = integrator.description();
  throw Error(ErrorCode::kInput, scene.first_medium() + ": the integrator '" + text.substr(0, text.find(' ')) +
                                     "' does not see participating media; 'path' does");
}

void declare(Settings& s, PathLengthSettings& v) {
  constexpr int kMost = 1 << 30;
  int max_depth = v.max_depth == PathLengthSettings::kUnlimited ? -1 : v.max_depth;
  s.group("Paths", OptionEffect::kSamples);
  s.whole("max-depth", max_depth, {.low = -1, .high = kMost},
          "Most path edges: 1 is emission seen directly, 2 direct light; -1: no limit", {.level = OptionLevel::kBasic});
  s.whole("min-depth", v.min_depth, {.low = 0, .high = kMost}, "Leave out paths with fewer edges than this");
  s.whole("rr-depth", v.rr_depth, {.low = 1, .high = kMost}, "Edges after which Russian roulette may end a path");
  s.on_off("hide-emitters", v.hide_emitters, "Whether lights that the camera sees directly are black");
  v.max_depth = max_depth < 0 ? PathLengthSettings::kUnlimited : max_depth;
}

std::string PathLengthSettings::text() const {
  const auto number = [](int depth) { return depth == kUnlimited ? std::string("unlimited") : std::to_string(depth); };
  return "min_depth=" + number(min_depth) + " max_depth=" + number(max_depth) + " rr_depth=" + number(rr_depth) +
         " hide_emitters=" + (hide_emitters ? "true" : "false");
}

}  // namespace covary
