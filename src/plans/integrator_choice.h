// SPDX-License-Identifier: Apache-2.0
// Which integrator a scene is loaded with: the scene's own, with the changes that a caller asks for.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "integrators/registry.h"
#include "io/load_scene.h"

namespace covary {

struct IntegratorChoice {
  std::string name;      ///< registered name; empty: the scene's
  OptionValues options;  ///< in place of the scene's; by names without dashes: "max-depth", "cv-grid"
};

/// For LoadOptions::make_integrator. It throws Error(kUsage) for options that the integrator does not have or that are
/// wrong.
std::function<std::shared_ptr<SceneObject>(Parameters&)> integrator_maker(const IntegratorChoice& choice);

/// The integrator of a scene that was loaded with one: its settings, for no scene yet.
const Integrator& integrator_of(const LoadedScene& scene);
/// The one that a request names in its place, or that.
struct RenderRequest;
const Integrator& integrator_of(const LoadedScene& scene, const RenderRequest& request);

/// The message for an unknown name, with the names there are.
std::string unknown_integrator(const std::string& name);

}  // namespace covary
