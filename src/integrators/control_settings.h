// SPDX-License-Identifier: Apache-2.0
// What `controlled-path` can be told, by a scene file or on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "sampling/coefficient_cache.h"
#include "sampling/light_set.h"
#include "scene/parameters.h"

namespace covary {

enum class ControlKind {
  kOff,     ///< no control variate: the plain estimate with the balance heuristic
  kRgb,     ///< one coefficient for each colour channel
  kMono,    ///< one coefficient for all
  kVevoda,  ///< for light samples alone, one coefficient for each colour channel, after [Vevoda2018]
  /// Optimal MIS weights of each pixel's direct light, from the pixel's samples so far [Kondapaneni2019].
  kOptimalMis,
};

/// Settings given one by one; those that are not keep their values.
struct ControlOptions {
  std::optional<ControlKind> kind;
  std::optional<LightSelection> lights;
  std::optional<uint32_t> grid, train_spp, clusters, memory_mib;
  std::optional<bool> relative, prefix, albedo, indirect;
  bool paper = false;

  /// Reads cv, cv_paper, lights, cv_grid, cv_train, cv_clusters, cv_variance, cv_prefix, cv_albedo,
  /// cv_indirect and cv_memory.
  static ControlOptions from(Parameters& parameters);
};

struct ControlSettings {
  static constexpr uint32_t kAutomaticGrid = 0;
  static constexpr uint32_t kMaxTrainingSpp = 1u << 16;

  ControlKind kind = ControlKind::kRgb;
  LightSelection lights = LightSelection::kPower;
  uint32_t grid = kAutomaticGrid;  ///< cells along the longest side of the scene
  uint32_t train_spp = 16;         ///< samples per pixel to learn from
  uint32_t clusters = 256;         ///< most clusters of lights
  uint32_t memory_mib = 256;       ///< of sums and coefficients while training
  bool relative = true;            ///< least relative variance [Hua2023] §4.2.1, otherwise least variance
  bool prefix = true;              ///< samples weigh by the throughput before them [Hua2023] §4.4
  bool albedo = true;              ///< see by_albedo()
  bool indirect = false;           ///< see controls_indirect()
  bool paper = false;              ///< the cache as published, see CacheSettings::published()

  /// Those of [Hua2023] and its authors' program: triangles, 64 cells, 16 samples per pixel.
  static ControlSettings published();
  /// With other settings in place of those given; `paper` replaces all others first.
  ControlSettings with(const ControlOptions& options) const;

  bool on() const { return kind != ControlKind::kOff; }
  /// Whether anything is learnt: coefficients, or how to choose lights.
  bool learns() const { return on() || lights == LightSelection::kLearned; }
  /// Samples per pixel of training, if any.
  uint32_t training_spp() const { return learns() ? train_spp : 0; }
  /// Training samples per pixel that first make an estimate of each pixel's value, and no coefficients.
  uint32_t pilot_spp() const { return learns() && relative && !per_pixel() ? (train_spp >= 4 ? 2 : train_spp / 2) : 0; }
  /// Whether each pixel has coefficients of its own, for the first surface, instead of each cell of space.
  bool per_pixel() const { return kind == ControlKind::kOptimalMis; }
  /// Whether the coefficients of a vertex are multiplied by its albedo: where there is one for each cell.
  bool by_albedo() const { return albedo && (kind == ControlKind::kRgb || kind == ControlKind::kMono); }
  /// Whether light that other surfaces reflect is controlled by bins of directions, too.
  bool controls_indirect() const { return indirect && (kind == ControlKind::kRgb || kind == ControlKind::kMono); }
  CacheSettings cache(uint32_t resolution) const;
  /// That of the bins of directions: wider cells, because there are many bins and their light is noisy.
  CacheSettings indirect_cache(uint32_t resolution) const;
  std::string text() const;
};

/// "off", "rgb", "mono", "vevoda", "optimal-mis".
std::string name_of(ControlKind kind);
/// The one of that name, or nothing.
std::optional<ControlKind> control_kind(const std::string& name);
std::optional<LightSelection> light_selection(const std::string& name);

}  // namespace covary
