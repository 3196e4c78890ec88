// SPDX-License-Identifier: Apache-2.0
// Integrators estimate the radiance along camera rays. They know nothing of pixels, films or estimators.
#pragma once

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/arena.h"
#include "core/random.h"
#include "scene/scene.h"
#include "settings/settings.h"

namespace covary {

/// What an integrator keeps for one thread from call to call of trace(): arrays that would cost time to make anew, and
/// what samples teach until it is collected.
class ThreadState {
 public:
  virtual ~ThreadState() = default;
};

class Integrator;

/// What one thread keeps while it traces paths of one integrator.
struct PathContext {
  explicit PathContext(const Integrator& integrator);
  /// The integrator's own state, which must be what its make_thread_state() makes.
  template <typename State>
  State& state_as() const {
    return static_cast<State&>(*state);
  }

  Arena arena;
  uint64_t n_rays = 0;
  std::unique_ptr<ThreadState> state;
  /// PassSettings::importance of the pixel of each sample that trace() is called with; empty where there is none.
  std::span<const Spectrum> importance;
};

/// One camera ray, the random numbers of its path, and the estimate of the radiance arriving along it.
struct CameraSample {
  Ray ray;
  PathRandom random;  ///< the integrator reads numbers at vertices >= 1 only
  Spectrum radiance;  ///< zero on entry
  /// Where the numbers of a light subpath come from, if there is one: subpath(Subpath::kLight) of these.
  PathRandom light_random = random;
};

/// How an integrator lives: it is made from parameters, gets the scene by prepare(), is trained if it learns
/// (integrators/training.h), and then traces. From prepare() or training on, nothing that all threads see changes.
class Integrator : public SceneObject {
 public:
  /// Called with the scene before anything but description(); again with the same scene it changes nothing.
  virtual void prepare(const Scene& /*scene*/) {}
  /// A fresh state for a thread; null when trace() keeps nothing. Thread-safe.
  virtual std::unique_ptr<ThreadState> make_thread_state() const { return nullptr; }
  /// Sets the radiance of each sample. Samples come in batches because hundreds of independent paths keep the machine
  /// busier than one; the value of a sample does not depend on its batch. Thread-safe.
  virtual void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const = 0;
  /// True when samples may be negative in a correct estimate, as differences are; the film then keeps them, where
  /// otherwise they count as errors and enter as black.
  virtual bool allows_negative() const { return false; }
  /// Registered name and settings, as they go into a film's attributes: equal text, equal estimator.
  virtual std::string description() const = 0;
};

inline PathContext::PathContext(const Integrator& integrator) : state(integrator.make_thread_state()) {}

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

/// One integrator. `make` declares its own settings.
struct IntegratorPlugin {
  const char* name;
  std::shared_ptr<Integrator> (*make)(Settings& settings, const PathLengthSettings& lengths);
};
/// All integrators, sorted by name.
std::span<const IntegratorPlugin> integrator_plugins();
/// The one of that name, or null.
const IntegratorPlugin* find_integrator(std::string_view name);
/// What their settings are: those of paths and those of their own. `name` is registered.
std::vector<Option> options_of_integrator(const std::string& name);
std::vector<std::string> integrator_names();
/// Names of those that have the option, without dashes; empty where none has.
std::vector<std::string> integrators_with_option(const std::string& option);
/// Declares settings of paths and of the integrator, and makes it.
std::shared_ptr<Integrator> make_integrator(const IntegratorPlugin& plugin, Settings& settings);

}  // namespace covary
