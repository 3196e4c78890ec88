// SPDX-License-Identifier: Apache-2.0
// What `guided-path` can be told, by a scene file or on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "integrators/control_settings.h"
#include "sampling/guiding_field.h"
#include "scene/parameters.h"

namespace covary {

/// Which share of directions is drawn from the mixture of guiding.
struct GuideFraction {
  float value = 0.5f;    ///< in (0, 1), where it is not learned
  bool learned = false;  ///< a fraction for each leaf of the field

  /// Reads "learned" or a number in (0, 1); nothing for another text.
  static std::optional<GuideFraction> from(const std::string& text);
  std::string text() const;
};

/// Settings given one by one; those that are not keep their values.
struct GuideOptions {
  std::optional<uint32_t> lobes, leaf_samples, train_spp;
  std::optional<GuideFraction> fraction;
  std::optional<float> roughness;
  std::optional<bool> nee;
  std::optional<ControlKind> control;
  std::optional<uint32_t> control_train_spp;

  /// Reads guide_lobes, guide_leaf, guide_train, guide_fraction, guide_roughness, nee, cv and cv_train.
  static GuideOptions from(Parameters& parameters);
};

struct GuideSettings {
  static constexpr uint32_t kMaxTrainingSpp = 1u << 16;
  static constexpr uint32_t kMinLeafSamples = 200, kMaxLeafSamples = 1u << 22;

  uint32_t lobes = 16;  ///< of a leaf at first, 1 to VmfLobes::kMax; splitting makes up to twice as many
  uint32_t leaf_samples = GuidingSettings().leaf_samples;  ///< a leaf with more is split, kMinLeafSamples or more
  uint32_t train_spp = 16;                                 ///< samples per pixel to learn from
  GuideFraction fraction;
  float roughness = 0.3f;                   ///< lobes of BSDFs that are less rough are not guided
  bool nee = true;                          ///< light samples (next-event estimation)
  ControlKind control = ControlKind::kOff;  ///< control variates on the lobes: kOff, kRgb or kMono
  uint32_t control_train_spp = 32;          ///< samples per pixel to learn their coefficients from, after the lobes

  bool controlled() const { return control != ControlKind::kOff; }
  /// Samples per pixel of the training.
  uint32_t training_spp() const { return train_spp + (controlled() ? control_train_spp : 0); }
  CacheSettings cache() const;

  GuideSettings with(const GuideOptions& options) const;
  GuidingSettings field() const;
  std::string text() const;
};

}  // namespace covary
