// SPDX-License-Identifier: Apache-2.0
// The settings of `controlled-path`.
#pragma once

#include <algorithm>
#include <cstdint>
#include <utility>

#include "sampling/coefficient_cache.h"
#include "sampling/light_set.h"
#include "settings/settings.h"

namespace covary {

enum class ControlKind {
  kOff,     ///< no control variate: the plain estimate with the balance heuristic
  kRgb,     ///< one coefficient per colour channel
  kMono,    ///< one coefficient for all
  kVevoda,  ///< for light samples only, one coefficient per colour channel, after [Vevoda2018]
  /// Optimal MIS weights for the direct light of each pixel, from its samples so far [Kondapaneni2019].
  kOptimalMis,
};

/// The variance that coefficients minimise.
enum class VarianceKind {
  kRelative,        ///< relative to the pixels' values [Hua2023] §4.2.1, the first samples denoised by a filter
  kRelativeByOidn,  ///< the same, denoised by Open Image Denoise
  kAbsolute,
};

struct ControlSettings {
  static constexpr uint32_t kAutomaticGrid = 0;
  static constexpr uint32_t kMaxTrainingSpp = 1u << 16;

  ControlKind kind = ControlKind::kRgb;
  LightSelection lights = LightSelection::kPower;
  uint32_t grid = kAutomaticGrid;  ///< cells along the longest side of the scene
  uint32_t train_spp = 16;         ///< samples per pixel to learn from
  uint32_t clusters = 256;         ///< maximum number of light clusters; see max_clusters()
  VarianceKind variance = VarianceKind::kRelative;
  bool albedo = true;  ///< see by_albedo()
  bool paper = false;  ///< as published, see solves_once() and CacheSettings::published()

  /// Those of [Hua2023] (Sec. 6.1): light selection by triangle, 5000 clusters (500 with kVevoda), 8 samples per pixel;
  /// 64 cells.
  static ControlSettings published();

  bool on() const { return kind != ControlKind::kOff; }
  /// Whether anything is learnt: coefficients, or light selection.
  bool learns() const { return on() || lights == LightSelection::kLearned; }
  /// Maximum number of light clusters. In the program of [Hua2023], that of [Vevoda2018] has fewer.
  uint32_t max_clusters() const {
    constexpr uint32_t kOfVevoda = 500;
    return paper && kind == ControlKind::kVevoda ? kOfVevoda : clusters;
  }
  /// Samples per pixel of training, if any.
  uint32_t training_spp() const { return learns() ? train_spp : 0; }
  /// Whether lights are selected as learnt: from the first wave on that ends after at least half of the training.
  bool learns_lights() const;
  bool ends_selection(uint32_t wave_end) const { return 2 * wave_end >= train_spp && wave_end < train_spp; }
  /// Training samples per pixel that only estimate each pixel's value first, without coefficients.
  uint32_t pilot_spp() const {
    if (!learns() || variance == VarianceKind::kAbsolute || per_pixel()) return 0;
    return train_spp >= 4 && !paper ? 2 : std::min(train_spp / 2, 1u);
  }
  /// Whether training uses plain samples and coefficients are solved once after it, as published.
  bool solves_once() const { return paper && !per_pixel(); }
  /// Whether each pixel has its own coefficients, for the first surface, instead of each spatial cell.
  bool per_pixel() const { return kind == ControlKind::kOptimalMis; }
  /// Whether each cell has a coefficient for each light and technique.
  bool has_cells() const { return kind == ControlKind::kRgb || kind == ControlKind::kMono; }
  /// Whether the coefficients of a vertex are multiplied by its albedo: only if they belong to cells.
  bool by_albedo() const { return albedo && has_cells(); }
  /// Bytes of sums and coefficients while training, beyond which cells are widened: 256 MiB, or, as the number of cells
  /// on surfaces grows, up to 4 GiB if a finer grid than 64 is asked for.
  size_t memory_limit() const {
    const size_t side = std::clamp(grid, 64u, 256u);
    return side * side << 16;
  }
  CacheSettings cache(uint32_t resolution) const;
};

inline constexpr std::pair<const char*, ControlKind> kControlKinds[] = {{"rgb", ControlKind::kRgb},
                                                                        {"mono", ControlKind::kMono},
                                                                        {"vevoda", ControlKind::kVevoda},
                                                                        {"optimal-mis", ControlKind::kOptimalMis},
                                                                        {"off", ControlKind::kOff}};

inline void declare(Settings& s, ControlSettings& v) {
  static constexpr std::pair<const char*, LightSelection> kSelections[] = {{"triangle", LightSelection::kTriangle},
                                                                           {"shape", LightSelection::kShape},
                                                                           {"power", LightSelection::kPower},
                                                                           {"learned", LightSelection::kLearned}};
  static constexpr std::pair<const char*, VarianceKind> kVariances[] = {
      {"relative", VarianceKind::kRelative},
      {"relative-oidn", VarianceKind::kRelativeByOidn},
      {"absolute", VarianceKind::kAbsolute}};
  s.group("Integrator controlled-path", OptionEffect::kSamples);
  if (s.preset("cv-paper")) v = ControlSettings::published();
  s.choice("cv", v.kind, kControlKinds, "Coefficients: per channel, one, of NEE only, per pixel", {.film = "cv={}"});
  s.choice("lights", v.lights, kSelections, "How lights are chosen: by triangle, shape, power, or as learnt",
           {.film = "lights={}"});
  s.flag("cv-paper", v.paper,
         "As published: `lights` triangle `cv-grid` 64 `cv-train` 8, cells by position, solved once",
         {.film = "paper"});
  s.whole<uint32_t>("cv-grid", v.grid, {.low = 0, .high = CellGrid::kMaxResolution},
                    {"auto", ControlSettings::kAutomaticGrid},
                    "Cells along the scene's longest side; auto: 32 to 256 by pixel size", {.film = "grid={}"});
  s.whole("cv-train", v.train_spp, {.low = 1, .high = ControlSettings::kMaxTrainingSpp},
          "Training samples per pixel, included in `spp`", {.film = "train={}"});
  s.choice("cv-variance", v.variance, kVariances, "Variance to minimise; oidn: pixels denoised by it",
           {.film = "variance={}"});
  s.only_if(v.learns(), {"cv-paper", "cv-grid", "cv-train", "cv-variance"},
            "with `cv` off: nothing is learnt (unless `lights` learned)");
  s.only_if(v.lights != LightSelection::kLearned || v.learns_lights(), {"lights"},
            "with `cv-train` " + std::to_string(v.train_spp) + ": no sample is left to learn it from; use 8 or more");
  s.only_if(!v.per_pixel(), {"cv-grid", "cv-variance"}, "with `cv` optimal-mis: each pixel has its own coefficients");
}

}  // namespace covary
