// SPDX-License-Identifier: Apache-2.0
// Integrators estimate the radiance along camera rays. They know nothing of pixels, films or estimators.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/arena.h"
#include "core/random.h"
#include "scene/scene.h"

namespace covary {

/// What an integrator keeps for one thread from call to call of trace(): arrays that would cost time to make anew, and
/// what samples teach until it is collected.
class ThreadState {
 public:
  virtual ~ThreadState() = default;
};

class Integrator;
class LearningIntegrator;
class LightTracingIntegrator;

/// Parts of samples' radiances: by the number of edges of their paths, or by the light that they come from.
struct RadianceByPart {
  size_t n_parts = 0;              ///< paths of 1 … n_parts edges, or groups of lights, are told apart; 0: none
  std::vector<Spectrum> radiance;  ///< those of one sample after another, in the order of trace()
};

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
  /// May be null. Once it is true, trace() may return early, with samples that are to be thrown away: paths that never
  /// end are asked at each of their edges.
  const std::atomic<bool>* stop = nullptr;
  bool stopped() const { return stop && stop->load(std::memory_order_relaxed); }
  /// PassSettings::importance of the pixel of each sample that trace() is called with; empty where there is none.
  std::span<const Spectrum> importance;
  RadianceByPart by_part;  ///< filled by integrators that have Integrator::longest_path(), or come of by_light()
};

/// One camera ray, the random numbers of its path, and the estimate of the radiance arriving along it.
struct CameraSample {
  Ray ray;
  PathRandom random;  ///< the integrator reads numbers at vertices >= 1 only
  Spectrum radiance;  ///< zero on entry
};

/// What an integrator tells of a render besides its image.
struct IntegratorReport {
  using Number = std::variant<uint64_t, double>;
  std::string name;  ///< of the numbers together; empty where there is nothing to tell
  std::vector<std::pair<std::string, Number>> numbers;
  std::string summary;  ///< one line
  std::vector<std::string> warnings;
};

/// How an integrator lives: it is made from parameters, gets the scene by prepare(), is trained if it learns
/// (passes/training.h), and then traces. From prepare() or training on, nothing that all threads see changes.
/// A loaded scene holds one that is never prepared; each render works with a clone.
class Integrator : public SceneObject {
 public:
  /// Another with the same settings, which knows no scene and has learnt nothing. Thread-safe.
  virtual std::shared_ptr<Integrator> clone() const = 0;
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

  // What some integrators can do besides. Nobody asks for the type of one.
  /// Itself where it learns from samples (training.h), otherwise null.
  virtual LearningIntegrator* learning() { return nullptr; }
  const LearningIntegrator* learning() const { return const_cast<Integrator*>(this)->learning(); }
  /// Itself where it traces light (light_pass.h), otherwise null.
  virtual LightTracingIntegrator* light_tracing() { return nullptr; }
  const LightTracingIntegrator* light_tracing() const { return const_cast<Integrator*>(this)->light_tracing(); }
  /// Most edges of its paths where trace() fills PathContext::by_part.
  virtual std::optional<int> longest_path() const { return {}; }
  /// Another, whose trace() takes the same samples and fills PathContext::by_part: by Emitter::group(), part i is that
  /// of groups[i], and the last one is of all other lights. Null where it cannot tell.
  virtual std::shared_ptr<Integrator> by_light(std::span<const std::string> /*groups*/) const { return nullptr; }
  /// Another, whose samples hold the part of this one's with the same random numbers that came by at most two edges:
  /// emission seen directly and direct light. Null where it has no such part.
  virtual std::shared_ptr<Integrator> of_direct_light() const { return nullptr; }
  /// Integrators one of which it stands for, the simplest first: which one is measured before a render
  /// (plans/integrator_trial.h), as it does not trace itself. Of all others empty.
  virtual std::span<const std::shared_ptr<Integrator>> choices() const { return {}; }
  /// What it cannot see of the scene, as warnings.
  virtual std::vector<std::string> blind_spots(const Scene& /*scene*/) const { return {}; }
  /// Whether it follows light through participating media.
  virtual bool sees_media() const { return false; }
  /// After the render.
  virtual IntegratorReport report() const { return {}; }
};

/// The first word of its description.
std::string registered_name(const Integrator& integrator);

/// Throws Error(kInput), "FILE:LINE: medium '…': …", where the scene has media and the integrator does not see them.
void require_sees_media(const Integrator& integrator, const Scene& scene);

inline PathContext::PathContext(const Integrator& integrator) : state(integrator.make_thread_state()) {}

}  // namespace covary
