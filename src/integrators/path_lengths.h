// SPDX-License-Identifier: Apache-2.0
// Which paths contribute, by number of edges.
#pragma once

#include <limits>
#include <string>

#include "settings/settings.h"

namespace covary {

/// Settings common to all integrators, with Mitsuba's meaning. The command line overrides the scene.
struct PathLengthSettings {
  static constexpr int kUnlimited = std::numeric_limits<int>::max();
  int min_depth = 0;           ///< paths with fewer edges do not contribute
  int max_depth = kUnlimited;  ///< maximum number of edges; 1: directly visible light only; 0: black
  int rr_depth = 5;            ///< Russian roulette begins after this many edges
  bool hide_emitters = false;  ///< lights are invisible to the camera
  std::string text() const;
};
void declare(Settings& settings, PathLengthSettings& lengths);

}  // namespace covary
