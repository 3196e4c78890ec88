// SPDX-License-Identifier: Apache-2.0
// The settings of `guided-path`.
#pragma once

#include <cstdint>
#include <utility>

#include "integrators/control_settings.h"
#include "sampling/guiding_field.h"
#include "settings/settings.h"

namespace covary {

struct GuideSettings {
  static constexpr uint32_t kMaxTrainingSpp = 1u << 16;
  static constexpr float kLearnedFraction = 0;  ///< a fraction for each leaf of the field
  static constexpr uint32_t kMinLeafSamples = 200, kMaxLeafSamples = 1u << 22;

  uint32_t lobes = 16;  ///< of a leaf at first, 1 to VmfLobes::kMax; splitting makes up to twice as many
  uint32_t leaf_samples = GuidingSettings().leaf_samples;  ///< a leaf with more is split, kMinLeafSamples or more
  uint32_t train_spp = 16;                                 ///< samples per pixel to learn from
  float fraction = 0.5f;                    ///< of directions that are guided, in (0, 1), or kLearnedFraction
  float roughness = 0.3f;                   ///< lobes of BSDFs that are less rough are not guided
  bool nee = true;                          ///< light samples (next-event estimation)
  ControlKind control = ControlKind::kOff;  ///< control variates on the lobes: kOff, kRgb or kMono
  uint32_t control_train_spp = 32;          ///< samples per pixel to learn their coefficients from, after the lobes

  bool controlled() const { return control != ControlKind::kOff; }
  /// Samples per pixel of the training.
  uint32_t training_spp() const { return train_spp + (controlled() ? control_train_spp : 0); }
  CacheSettings cache() const;

  bool learns_fraction() const { return fraction == kLearnedFraction; }
  GuidingSettings field() const;
};

inline void declare(Settings& s, GuideSettings& v) {
  static constexpr std::pair<const char*, ControlKind> kControls[] = {
      {"rgb", ControlKind::kRgb}, {"mono", ControlKind::kMono}, {"off", ControlKind::kOff}};
  s.group("Integrator guided-path", OptionEffect::kSamples);
  s.whole("guiding-lobes", v.lobes, {.low = 1, .high = VmfLobes::kMax},
          "Initial lobes per leaf; splitting makes up to twice as many",
          {.aliases = {"guide-lobes"}, .film = "lobes={}"});
  s.whole("guiding-leaf", v.leaf_samples,
          {.low = GuideSettings::kMinLeafSamples, .high = GuideSettings::kMaxLeafSamples},
          "Samples per leaf; leaves with more are split", {.aliases = {"guide-leaf"}, .film = "leaf={}"});
  s.whole("guiding-train", v.train_spp, {.low = 1, .high = GuideSettings::kMaxTrainingSpp},
          "Training samples per pixel, included in `spp`", {.aliases = {"guide-train"}, .film = "train={}"});
  s.real<float>("guiding-fraction", v.fraction, {.low = 0, .high = 1, .above_low = true, .below_high = true},
                {"learned", GuideSettings::kLearnedFraction}, "Fraction of guided directions; learned: per leaf",
                {.aliases = {"guide-fraction"}, .film = "fraction={}"});
  s.real("guiding-roughness", v.roughness, {.low = 0, .high = 1}, "BSDF lobes with a lower roughness are not guided",
         {.aliases = {"guide-roughness"}, .film = "roughness={:f}"});
  s.on_off("nee", v.nee, "Light samples at each vertex (next-event estimation)", {.film = "nee={}"});
  s.choice("cv", v.control, kControls, "Control variates on the lobes", {.film = "cv={}"});
  s.whole("cv-train", v.control_train_spp, {.low = 1, .high = GuideSettings::kMaxTrainingSpp},
          "Training samples per pixel for their coefficients, after those for the lobes", {.film = "cv_train={}"});
  s.only_if(v.controlled(), {"cv-train"}, "without control variates (`cv` rgb or mono)");
}

}  // namespace covary
