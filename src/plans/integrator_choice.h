// SPDX-License-Identifier: Apache-2.0
// The integrator that a scene is loaded with: the scene's own, with the changes that a caller requests.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "integrators/registry.h"
#include "io/load_scene.h"

namespace covary {

struct IntegratorChoice {
  std::string name;      ///< registered name; empty: the scene's
  OptionValues options;  ///< override the scene's; by names without dashes: "max-depth", "cv-grid"
};

/// For LoadOptions::make_integrator. Throws Error(kUsage) for invalid options or options that the integrator does not
/// have.
std::function<std::shared_ptr<SceneObject>(Parameters&)> integrator_maker(const IntegratorChoice& choice);

/// The integrator that a scene was loaded with: its settings, not yet prepared.
const Integrator& integrator_of(const LoadedScene& scene);
/// The integrator named by the request or, by default, the scene's.
struct RenderRequest;
const Integrator& integrator_of(const LoadedScene& scene, const RenderRequest& request);

/// The message for an unknown name, listing the known ones.
std::string unknown_integrator(const std::string& name);

}  // namespace covary
