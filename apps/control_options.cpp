// SPDX-License-Identifier: Apache-2.0
#include "control_options.h"

#include <fmt/format.h>

#include "integrators/controlled_path.h"
#include "integrators/guided_path.h"
#include "numbers.h"

namespace covary {
namespace {

constexpr uint32_t kMaxNumber = 1u << 30;

/// Control variates that guided-path has, too.
bool one_of_guided(const std::string& kind) { return kind == "rgb" || kind == "mono" || kind == "off"; }

}  // namespace

void add_control_options(CLI::App& command, ControlTexts& texts) {
  command
      .add_option("--cv", texts.kind,
                  "Control variates: one coefficient for each colour, for all, of light samples alone, by pixel for "
                  "the first surface, or none")
      ->check(one_of({"rgb", "mono", "vevoda", "optimal-mis", "off"}))
      ->group(kControlGroup);
  command
      .add_flag("--cv-paper", texts.paper,
                "The published method: --lights triangle --cv-grid 64 --cv-train 16, cells by position alone")
      ->group(kControlGroup);
  command
      .add_option("--lights", texts.lights,
                  "How lights are chosen: uniformly over emissive triangles, over shapes, by power, or as training "
                  "tells")
      ->check(one_of({"triangle", "shape", "power", "learned"}))
      ->group(kControlGroup);
  command
      .add_option("--cv-grid", texts.grid, "Cells along the longest side of the scene, or auto: by the size of pixels")
      ->group(kControlGroup);
  command
      .add_option("--cv-train", texts.train_spp,
                  "Samples per pixel to learn from, a part of --spp that is not in the image; default: 16")
      ->transform(whole_number(1u, ControlSettings::kMaxTrainingSpp))
      ->group(kControlGroup);
  command.add_option("--cv-clusters", texts.clusters, "Most clusters of lights; default: 256")
      ->transform(whole_number(1u, kMaxNumber))
      ->group(kControlGroup);
  command.add_option("--cv-variance", texts.variance, "What is made least: relative or absolute variance")
      ->check(one_of({"relative", "absolute"}))
      ->group(kControlGroup);
  const auto add_switch = [&](const char* name, std::string& text, const char* help) {
    command.add_option(name, text, help)->check(one_of({"on", "off"}))->group(kControlGroup);
  };
  add_switch("--cv-prefix", texts.prefix,
             "Whether samples weigh by the throughput of the path before them; default: on");
  add_switch("--cv-albedo", texts.albedo,
             "Whether coefficients are multiplied by the albedo of the surface (--cv rgb and mono); default: on");
  add_switch("--cv-indirect", texts.indirect,
             "Whether light that other surfaces reflect is controlled, too (--cv rgb and mono); default: off");
  command
      .add_option("--cv-memory", texts.memory_mib,
                  "MiB of sums and coefficients while learning, then cells become wider; default: 256")
      ->transform(whole_number(1u, kMaxNumber))
      ->group(kControlGroup);
  command
      .add_flag("--path-lengths", texts.path_lengths,
                "Add an image for each number of edges of paths (Edges01, …) to the output")
      ->group(kControlGroup);
}

std::optional<ControlOptions> control_options(const ControlTexts& texts) {
  if (command_words(texts).empty()) return {};
  ControlOptions options;
  options.paper = texts.paper;
  if (!texts.kind.empty()) options.kind = control_kind(texts.kind);
  if (!texts.lights.empty()) options.lights = light_selection(texts.lights);
  if (texts.grid == "auto") {
    options.grid = ControlSettings::kAutomaticGrid;
  } else if (!texts.grid.empty()) {
    options.grid = parse_whole<uint32_t>(texts.grid);
    if (options.grid.value_or(0) < 1 || *options.grid > CellGrid::kMaxResolution)
      throw Error(ErrorCode::kUsage, "--cv-grid '" + texts.grid + "': expected auto or a whole number from 1 to " +
                                         std::to_string(CellGrid::kMaxResolution));
  }
  options.train_spp = texts.train_spp, options.clusters = texts.clusters, options.memory_mib = texts.memory_mib;
  if (!texts.variance.empty()) options.relative = texts.variance == "relative";
  if (!texts.prefix.empty()) options.prefix = texts.prefix == "on";
  if (!texts.indirect.empty()) options.indirect = texts.indirect == "on";
  if (!texts.albedo.empty()) options.albedo = texts.albedo == "on";
  return options;
}

void check_control_options(const ControlTexts& texts, const LoadedScene& scene, const std::string& integrator) {
  if (dynamic_cast<const ControlledPath*>(scene.integrator.get())) return;
  ControlTexts foreign = texts;
  if (dynamic_cast<const GuidedPath*>(scene.integrator.get())) {
    if (!texts.kind.empty() && !one_of_guided(texts.kind))
      throw Error(ErrorCode::kUsage, fmt::format("--cv {}: guided-path knows rgb, mono and off", texts.kind));
    foreign.kind.clear(), foreign.train_spp.reset();
  }
  std::vector<std::string> words = command_words(foreign);
  if (texts.path_lengths) words.emplace_back("--path-lengths");
  if (words.empty()) return;
  throw Error(ErrorCode::kUsage, fmt::format("{} is an option of --integrator controlled-path, not of {}", words[0],
                                             integrator.empty() ? scene.integrator_type : integrator));
}

std::vector<std::string> command_words(const ControlTexts& texts) {
  std::vector<std::string> words;
  if (texts.paper) words.emplace_back("--cv-paper");
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  const auto number = [](const std::optional<uint32_t>& value) { return value ? std::to_string(*value) : ""; };
  add("--cv", texts.kind);
  add("--lights", texts.lights);
  add("--cv-grid", texts.grid);
  add("--cv-train", number(texts.train_spp));
  add("--cv-clusters", number(texts.clusters));
  add("--cv-variance", texts.variance);
  add("--cv-prefix", texts.prefix);
  add("--cv-albedo", texts.albedo);
  add("--cv-indirect", texts.indirect);
  add("--cv-memory", number(texts.memory_mib));
  return words;
}

}  // namespace covary
