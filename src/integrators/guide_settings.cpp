// SPDX-License-Identifier: Apache-2.0
#include "integrators/guide_settings.h"

#include <algorithm>
#include <charconv>
#include <limits>

namespace covary {

std::optional<GuideFraction> GuideFraction::from(const std::string& text) {
  if (text == "learned") return GuideFraction{0.5f, true};
  float value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !(value > 0 && value < 1)) return {};
  return GuideFraction{value, false};
}

std::string GuideFraction::text() const {
  if (learned) return "learned";
  char digits[32];
  return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
}

GuideOptions GuideOptions::from(Parameters& parameters) {
  GuideOptions options;
  const auto number = [&](const char* name, uint32_t highest, uint32_t lowest = 1) -> std::optional<uint32_t> {
    if (!parameters.has(name)) return {};
    const auto low = static_cast<int>(lowest);
    return static_cast<uint32_t>(parameters.get_int(name, low, low, static_cast<int>(highest)));
  };
  options.lobes = number("guide_lobes", VmfLobes::kMax);
  options.leaf_samples = number("guide_leaf", GuideSettings::kMaxLeafSamples, GuideSettings::kMinLeafSamples);
  options.train_spp = number("guide_train", GuideSettings::kMaxTrainingSpp);
  if (parameters.has("guide_fraction")) {
    const std::string text = parameters.get_string("guide_fraction", "0.5");
    options.fraction = GuideFraction::from(text);
    if (!options.fraction)
      parameters.error("guide_fraction '" + text + "': expected learned or a number above 0 and below 1");
  }
  if (parameters.has("guide_roughness")) options.roughness = parameters.get_float("guide_roughness", 0, 0, 1);
  if (parameters.has("nee")) options.nee = parameters.get_bool("nee", true);
  if (parameters.has("cv")) options.control = control_kind(parameters.get_choice("cv", "off", {"off", "rgb", "mono"}));
  options.control_train_spp = number("cv_train", GuideSettings::kMaxTrainingSpp);
  return options;
}

GuideSettings GuideSettings::with(const GuideOptions& options) const {
  GuideSettings settings = *this;
  settings.lobes = options.lobes.value_or(lobes);
  settings.leaf_samples = options.leaf_samples.value_or(leaf_samples);
  settings.train_spp = options.train_spp.value_or(train_spp);
  settings.fraction = options.fraction.value_or(fraction);
  settings.roughness = options.roughness.value_or(roughness);
  settings.nee = options.nee.value_or(nee);
  settings.control = options.control.value_or(control);
  settings.control_train_spp = options.control_train_spp.value_or(control_train_spp);
  return settings;
}

GuidingSettings GuideSettings::field() const {
  GuidingSettings settings;
  settings.fit.n_lobes = static_cast<int>(lobes);
  settings.fit.max_lobes = std::min(2 * settings.fit.n_lobes, VmfLobes::kMax);
  settings.leaf_samples = leaf_samples;
  settings.learn_fraction = fraction.learned;
  return settings;
}

std::string GuideSettings::text() const {
  return "lobes=" + std::to_string(lobes) + " leaf=" + std::to_string(leaf_samples) +
         " train=" + std::to_string(train_spp) + " fraction=" + fraction.text() +
         " roughness=" + std::to_string(roughness) + " nee=" + (nee ? "on" : "off") + " cv=" + name_of(control) +
         (controlled() ? " cv_train=" + std::to_string(control_train_spp) : "");
}

CacheSettings GuideSettings::cache() const {
  CacheSettings settings;
  settings.pyramid = false;  // lobes of one leaf are not those of another
  settings.monochrome = control == ControlKind::kMono;
  settings.memory_limit = std::numeric_limits<size_t>::max();  // leaves have no wider ones
  return settings;
}

}  // namespace covary
