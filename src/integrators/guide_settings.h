// SPDX-License-Identifier: Apache-2.0
// What `guided-path` can be told, by a scene file or on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

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
  std::optional<uint32_t> lobes, train_spp;
  std::optional<GuideFraction> fraction;
  std::optional<float> roughness;
  std::optional<bool> nee;

  /// Reads guide_lobes, guide_train, guide_fraction, guide_roughness and nee.
  static GuideOptions from(Parameters& parameters);
};

struct GuideSettings {
  static constexpr uint32_t kMaxTrainingSpp = 1u << 16;

  uint32_t lobes = 16;      ///< of a leaf at first, 1 to VmfLobes::kMax; splitting makes up to twice as many
  uint32_t train_spp = 16;  ///< samples per pixel to learn from
  GuideFraction fraction;
  float roughness = 0.1f;  ///< lobes of BSDFs that are less rough are not guided
  bool nee = true;         ///< light samples (next-event estimation)

  GuideSettings with(const GuideOptions& options) const;
  GuidingSettings field() const;
  std::string text() const;
};

}  // namespace covary
