// SPDX-License-Identifier: Apache-2.0
// Which paths contribute, by their numbers of edges.
#pragma once

#include <limits>
#include <string>

#include "settings/settings.h"

namespace covary {

/// Settings every integrator has; Mitsuba's meaning. The command line overrides those of the scene.
struct PathLengthSettings {
  static constexpr int kUnlimited = std::numeric_limits<int>::max();
  int min_depth = 0;           ///< contributions of paths with fewer edges are left out
  int max_depth = kUnlimited;  ///< largest number of path edges; 1: directly visible light only; 0: black
  int rr_depth = 5;            ///< number of edges after which Russian roulette begins
  bool hide_emitters = false;  ///< lights are invisible to the camera
  std::string text() const;
};
void declare(Settings& settings, PathLengthSettings& lengths);

}  // namespace covary
