// SPDX-License-Identifier: Apache-2.0
#include "guide_options.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/error.h"
#include "integrators/guided_path.h"
#include "numbers.h"

namespace covary {

void add_guide_options(CLI::App& command, GuideTexts& texts) {
  command
      .add_option("--guide-lobes", texts.lobes,
                  "Lobes of a leaf at first, 1 to 32; splitting makes up to twice as many; default: 16")
      ->transform(whole_number(1u, static_cast<uint32_t>(VmfLobes::kMax)))
      ->group(kGuideGroup);
  command.add_option("--guide-leaf", texts.leaf_samples, "Samples of a leaf; one with more is split; default: 8000")
      ->transform(whole_number(GuideSettings::kMinLeafSamples, GuideSettings::kMaxLeafSamples))
      ->group(kGuideGroup);
  command.add_option("--guide-train", texts.train_spp, "Samples per pixel to learn from, a part of --spp; default: 16")
      ->transform(whole_number(1u, GuideSettings::kMaxTrainingSpp))
      ->group(kGuideGroup);
  command
      .add_option("--guide-fraction", texts.fraction,
                  "Fraction of guided directions, above 0 and below 1, or learned for each leaf; default: 0.5")
      ->group(kGuideGroup);
  command.add_option("--nee", texts.nee, "Light samples at each vertex (next-event estimation); default: on")
      ->check(one_of({"on", "off"}))
      ->group(kGuideGroup);
}

std::optional<GuideOptions> guide_options(const GuideTexts& texts) {
  if (command_words(texts).empty()) return {};
  GuideOptions options;
  options.lobes = texts.lobes, options.leaf_samples = texts.leaf_samples, options.train_spp = texts.train_spp;
  if (!texts.fraction.empty()) {
    options.fraction = GuideFraction::from(texts.fraction);
    if (!options.fraction)
      throw Error(ErrorCode::kUsage, "--guide-fraction '" + texts.fraction +
                                         "': expected learned or a number above 0 and below 1, e.g. 0.5");
  }
  if (!texts.nee.empty()) options.nee = texts.nee == "on";
  return options;
}

void check_guide_options(const GuideTexts& texts, const LoadedScene& scene, const std::string& integrator) {
  const std::vector<std::string> words = command_words(texts);
  if (words.empty() || dynamic_cast<const GuidedPath*>(scene.integrator.get())) return;
  throw Error(ErrorCode::kUsage, fmt::format("{} is an option of --integrator guided-path, not of {}", words[0],
                                             integrator.empty() ? scene.integrator_type : integrator));
}

void warn_of_unseen_lights(LoadedScene& scene) {
  const auto* guided = dynamic_cast<const GuidedPath*>(scene.integrator.get());
  if (!guided || guided->settings().nee) return;
  const auto n = std::ranges::count_if(scene.scene->emitters(), [](const auto& light) { return light->is_delta(); });
  if (n > 0)
    scene.warnings.push_back(
        fmt::format("without light samples (--nee off), lights at a point or in one direction are not seen: {} of {}",
                    n, scene.scene->emitters().size()));
}

std::vector<std::string> command_words(const GuideTexts& texts) {
  std::vector<std::string> words;
  const auto add = [&](const char* option, const std::string& value) {
    if (!value.empty()) words.insert(words.end(), {option, value});
  };
  const auto number = [](const std::optional<uint32_t>& value) { return value ? std::to_string(*value) : ""; };
  add("--guide-lobes", number(texts.lobes));
  add("--guide-leaf", number(texts.leaf_samples));
  add("--guide-train", number(texts.train_spp));
  add("--guide-fraction", texts.fraction);
  add("--nee", texts.nee);
  return words;
}

}  // namespace covary
