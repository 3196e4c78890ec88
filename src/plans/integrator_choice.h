// SPDX-License-Identifier: Apache-2.0
// Which integrator a scene is loaded with: the scene's own, with the changes that a caller asks for.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "integrators/control_settings.h"
#include "integrators/guide_settings.h"
#include "integrators/integrator.h"
#include "io/load_scene.h"

namespace covary {

struct IntegratorChoice {
  std::string name;              ///< registered name; empty: the scene's
  std::optional<int> min_depth;  ///< leave out paths with fewer edges
  std::optional<int> max_depth;  ///< largest number of path edges; < 0: no limit
  /// For `controlled-path`; other integrators have none of these settings, which the caller checks.
  std::optional<ControlOptions> control;
  /// Likewise for `guided-path`.
  std::optional<GuideOptions> guide;
  /// Settings of light tracing are no mistake where the chosen integrator traces none: they are those of options, which
  /// the caller checks, or of an element whose integrator another one replaces.
  bool tolerates_light = false;
};

/// For LoadOptions::make_integrator.
std::function<std::shared_ptr<SceneObject>(Parameters&)> integrator_maker(const IntegratorChoice& choice);

/// nullptr where there is none of that name.
const IntegratorPlugin* find_integrator(const std::string& name);
/// The message for an unknown name, with the names there are.
std::string unknown_integrator(const std::string& name);

}  // namespace covary
