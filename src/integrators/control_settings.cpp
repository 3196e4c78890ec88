// SPDX-License-Identifier: Apache-2.0
#include "integrators/control_settings.h"

#include <algorithm>
#include <vector>

namespace covary {
namespace {

constexpr ControlKind kKinds[] = {ControlKind::kOff, ControlKind::kRgb, ControlKind::kMono, ControlKind::kVevoda,
                                  ControlKind::kOptimalMis};
constexpr LightSelection kSelections[] = {LightSelection::kTriangle, LightSelection::kShape, LightSelection::kPower,
                                          LightSelection::kLearned};
constexpr int kMaxInt = 1 << 30;

template <typename T>
void take(const std::optional<T>& option, T& setting) {
  if (option) setting = *option;
}

std::optional<uint32_t> optional_number(Parameters& parameters, const std::string& name, int lowest, int highest) {
  if (!parameters.has(name)) return {};
  return static_cast<uint32_t>(parameters.get_int(name, lowest, lowest, highest));
}

}  // namespace

std::string name_of(ControlKind kind) {
  switch (kind) {
    case ControlKind::kOff:
      return "off";
    case ControlKind::kRgb:
      return "rgb";
    case ControlKind::kMono:
      return "mono";
    case ControlKind::kVevoda:
      return "vevoda";
    case ControlKind::kOptimalMis:
      return "optimal-mis";
  }
  throw Error(ErrorCode::kInternal, "unknown kind of control variate");
}

std::optional<ControlKind> control_kind(const std::string& name) {
  for (const ControlKind kind : kKinds)
    if (name == name_of(kind)) return kind;
  return {};
}

std::optional<LightSelection> light_selection(const std::string& name) {
  for (const LightSelection selection : kSelections)
    if (name == name_of(selection)) return selection;
  return {};
}

ControlOptions ControlOptions::from(Parameters& parameters) {
  ControlOptions options;
  std::vector<std::string> kinds, selections;
  for (const ControlKind kind : kKinds) kinds.push_back(name_of(kind));
  for (const LightSelection selection : kSelections) selections.push_back(name_of(selection));
  if (parameters.has("cv")) options.kind = control_kind(parameters.get_choice("cv", "rgb", kinds));
  if (parameters.has("lights")) options.lights = light_selection(parameters.get_choice("lights", "power", selections));
  options.paper = parameters.get_bool("cv_paper", false);
  options.grid = optional_number(parameters, "cv_grid", 0, CellGrid::kMaxResolution);
  options.train_spp = optional_number(parameters, "cv_train", 1, ControlSettings::kMaxTrainingSpp);
  options.clusters = optional_number(parameters, "cv_clusters", 1, kMaxInt);
  options.memory_mib = optional_number(parameters, "cv_memory", 1, kMaxInt);
  if (parameters.has("cv_variance"))
    options.relative = parameters.get_choice("cv_variance", "relative", {"relative", "absolute"}) == "relative";
  if (parameters.has("cv_prefix")) options.prefix = parameters.get_bool("cv_prefix", true);
  if (parameters.has("cv_indirect")) options.indirect = parameters.get_bool("cv_indirect", false);
  if (parameters.has("cv_albedo")) options.albedo = parameters.get_bool("cv_albedo", true);
  return options;
}

ControlSettings ControlSettings::published() {
  ControlSettings settings;
  settings.paper = true;
  settings.lights = LightSelection::kTriangle;
  settings.grid = 64;
  settings.clusters = 5000;
  settings.albedo = false;
  return settings;
}

ControlSettings ControlSettings::with(const ControlOptions& options) const {
  ControlSettings settings = options.paper ? published() : *this;
  take(options.kind, settings.kind);
  take(options.lights, settings.lights);
  take(options.grid, settings.grid);
  take(options.train_spp, settings.train_spp);
  take(options.clusters, settings.clusters);
  take(options.memory_mib, settings.memory_mib);
  take(options.relative, settings.relative);
  take(options.prefix, settings.prefix);
  take(options.albedo, settings.albedo);
  take(options.indirect, settings.indirect);
  return settings;
}

CacheSettings ControlSettings::cache(uint32_t resolution) const {
  CacheSettings settings;
  if (paper || per_pixel())
    settings = CacheSettings::published(resolution);
  else
    settings.resolution = resolution;
  settings.monochrome = kind == ControlKind::kMono;
  settings.memory_limit = (size_t{memory_mib} << 20) / (controls_indirect() ? 2 : 1);
  return settings;
}

CacheSettings ControlSettings::indirect_cache(uint32_t resolution) const {
  CacheSettings settings = cache(std::max(1u, resolution / 4));
  settings.prior_samples = 16;
  return settings;
}

std::string ControlSettings::text() const {
  const std::string selection = "cv=" + name_of(kind) + " lights=" + name_of(lights);
  if (!learns()) return selection;
  const auto number = [](uint32_t value) { return std::to_string(value); };
  return selection + (paper ? " paper" : "") + " grid=" + (grid == kAutomaticGrid ? "auto" : number(grid)) +
         " train=" + number(train_spp) + " clusters=" + number(clusters) + " memory=" + number(memory_mib) +
         " variance=" + (relative ? "relative" : "absolute") + " prefix=" + (prefix ? "on" : "off") +
         (by_albedo() ? " albedo" : "") + (controls_indirect() ? " indirect" : "");
}

}  // namespace covary
