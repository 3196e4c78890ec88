// SPDX-License-Identifier: Apache-2.0
// Integrators estimate the radiance along camera rays. They know nothing of pixels, films or estimators.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

#include "core/arena.h"
#include "core/random.h"
#include "scene/parameters.h"
#include "scene/scene.h"

namespace covary {

/// What one thread keeps while it traces paths.
struct PathContext {
  Arena arena;
  uint64_t n_rays = 0;
};

/// One camera ray, the random numbers of its path, and the estimate of the radiance arriving along it.
struct CameraSample {
  Ray ray;
  PathRandom random;  ///< the integrator reads numbers at vertices >= 1 only
  Spectrum radiance;  ///< zero on entry
};

class Integrator : public SceneObject {
 public:
  /// Sets the radiance of each sample. Samples come in batches because hundreds of independent paths keep the machine
  /// busier than one; the value of a sample does not depend on its batch. Thread-safe.
  virtual void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const = 0;
  /// Registered name and settings, as they go into a film's attributes: equal text, equal estimator.
  virtual std::string description() const = 0;
};

/// Settings every integrator has; Mitsuba's meaning. The command line overrides those of the scene.
struct PathLengthSettings {
  static constexpr int kUnlimited = std::numeric_limits<int>::max();
  int min_depth = 0;           ///< contributions of paths with fewer edges are left out
  int max_depth = kUnlimited;  ///< largest number of path edges; 1: directly visible light only; 0: black
  int rr_depth = 5;            ///< number of edges after which Russian roulette begins
  bool hide_emitters = false;  ///< lights are invisible to the camera
  /// Reads max_depth (-1: unlimited), rr_depth and hide_emitters.
  static PathLengthSettings from(Parameters& parameters);
  std::string text() const;
};

/// One integrator: how to make it from a scene's element, and which of its settings the command line may change.
struct IntegratorPlugin {
  const char* name;
  std::shared_ptr<Integrator> (*make)(Parameters& parameters, const PathLengthSettings& lengths);
};
/// All integrators, sorted by name.
std::span<const IntegratorPlugin> integrator_plugins();

}  // namespace covary
