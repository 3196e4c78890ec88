// SPDX-License-Identifier: Apache-2.0
#include "light_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "integrators/light_pass.h"
#include "numbers.h"

namespace covary {
namespace {

/// An option and the integrator's property of the same name with '_' for '-'.
struct Setting {
  const char* name;
  std::optional<std::string> LightOptions::*text;
  bool is_number;
};
constexpr Setting kSettings[] = {
    {"light-tracing", &LightOptions::light_tracing, false},
    {"light-paths", &LightOptions::light_paths, true},
    {"heuristic", &LightOptions::heuristic, false},
};

std::string property_name(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

}  // namespace

void add_light_options(CLI::App& command, LightOptions& o) {
  const auto add = [&](const char* name, std::optional<std::string>& value, const char* help) {
    return command.add_option(name, value, help)->group("Integrators that trace light");
  };
  add("--light-tracing", o.light_tracing,
      "A pass of light paths beside the camera's, added to the image; auto: not beside common random numbers")
      ->check(one_of({"auto", "on", "off"}));
  add("--light-paths", o.light_paths, "Light paths for each camera sample")->check(real_number(1e-3, 1e3));
  add("--heuristic", o.heuristic, "How strategies are weighted")->check(one_of({"power", "balance"}));
  command.add_option("--replay-light", o.replay, "NUMBER: print what one light path adds to the image")
      ->transform(whole_number(uint64_t{0}, (uint64_t{1} << 40) - 1))
      ->type_name("NUMBER")
      ->group("Integrators that trace light");
}

std::vector<Property> integrator_properties(const LightOptions& options) {
  std::vector<Property> properties;
  for (const Setting& setting : kSettings) {
    const std::optional<std::string>& text = options.*setting.text;
    if (!text) continue;
    const Value value = setting.is_number ? Value(*parse_real(*text)) : Value(*text);
    properties.push_back({property_name(setting.name), value, {std::string("--") + setting.name, 0, 0}});
  }
  return properties;
}

std::vector<std::string> option_words(const LightOptions& options) {
  std::vector<std::string> words;
  for (const Setting& setting : kSettings)
    if (options.*setting.text) words.insert(words.end(), {std::string("--") + setting.name, *(options.*setting.text)});
  return words;
}

void check_light_options(const LightOptions& options, const LoadedScene& scene, const std::string& integrator,
                         bool has_crn_pass) {
  std::vector<std::string> words = option_words(options);
  if (options.replay) words.emplace_back("--replay-light");
  if (words.empty()) return;
  if (const auto* tracer = dynamic_cast<const LightTracingIntegrator*>(scene.integrator.get())) {
    if (options.light_paths && !tracer->wants_light_pass(has_crn_pass))
      throw Error(ErrorCode::kUsage,
                  fmt::format("--light-paths has no effect {}",
                              options.light_tracing.value_or("auto") == "auto" && has_crn_pass
                                  ? "beside a pass with common random numbers: no light is traced there without "
                                    "--light-tracing on"
                                  : "without light tracing (--light-tracing on)"));
    return;
  }
  throw Error(ErrorCode::kUsage, fmt::format("{} is an option of integrators that trace light; '{}' does not", words[0],
                                             integrator.empty() ? scene.integrator_type : integrator));
}

}  // namespace covary
