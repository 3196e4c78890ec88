// SPDX-License-Identifier: Apache-2.0
// Integrators estimate the radiance along camera rays. They know nothing about pixels, films or estimators.
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

/// Per-thread state of an integrator, kept between calls of trace(): arrays that are expensive to allocate, and
/// training data until it is collected.
class ThreadState {
 public:
  virtual ~ThreadState() = default;
};

class Integrator;
class LearningIntegrator;
class LightTracingIntegrator;

/// The radiance of samples, split by path length in edges or by light source.
struct RadianceByPart {
  size_t n_parts = 0;              ///< paths of 1 … n_parts edges, or groups of lights, are separated; 0: none
  std::vector<Spectrum> radiance;  ///< n_parts values for each sample, in the order of trace()
};

/// State of one thread while it traces paths of one integrator.
struct PathContext {
  explicit PathContext(const Integrator& integrator);
  /// The integrator's own state, made by its make_thread_state().
  template <typename State>
  State& state_as() const {
    return static_cast<State&>(*state);
  }

  Arena arena;
  uint64_t n_rays = 0;
  std::unique_ptr<ThreadState> state;
  /// May be null. Once it is true, trace() may return early, with samples to be discarded: paths that never end check
  /// it at each edge.
  const std::atomic<bool>* stop = nullptr;
  bool stopped() const { return stop && stop->load(std::memory_order_relaxed); }
  /// PassSettings::importance of the pixel of each sample of this call of trace(); empty if there is none.
  std::span<const Spectrum> importance;
  RadianceByPart by_part;  ///< filled by integrators with Integrator::longest_path(), or from by_light()
};

/// One camera ray, the random numbers of its path, and the estimate of the radiance arriving along it.
struct CameraSample {
  Ray ray;
  PathRandom random;  ///< the integrator only uses numbers at vertices >= 1
  Spectrum radiance;  ///< zero on entry
};

/// What an integrator reports about a render besides its image.
struct IntegratorReport {
  using Number = std::variant<uint64_t, double>;
  std::string name;  ///< title of the numbers; empty if there are none
  std::vector<std::pair<std::string, Number>> numbers;
  std::string summary;  ///< one line
  std::vector<std::string> warnings;
};

/// Life cycle of an integrator: made from parameters, given the scene by prepare(), trained if it learns
/// (passes/training.h), then traces. After prepare() or training, nothing that threads share changes. A loaded scene
/// holds an integrator that is never prepared; each render works with a clone.
class Integrator : public SceneObject {
 public:
  /// A copy with the same settings, without scene or training. Thread-safe.
  virtual std::shared_ptr<Integrator> clone() const = 0;
  /// Called with the scene before anything but description(); calling it again with the same scene has no effect.
  virtual void prepare(const Scene& /*scene*/) {}
  /// A fresh state for a thread; null if trace() needs none. Thread-safe.
  virtual std::unique_ptr<ThreadState> make_thread_state() const { return nullptr; }
  /// Sets the radiance of each sample. Samples come in batches, because hundreds of independent paths use the machine
  /// better than one; a sample's value does not depend on its batch. Thread-safe.
  virtual void trace(const Scene& scene, std::span<CameraSample> samples, PathContext& context) const = 0;
  /// True if samples of a correct estimate may be negative, as differences are. The film then keeps them; otherwise
  /// they count as errors and enter as black.
  virtual bool allows_negative() const { return false; }
  /// Registered name and settings, for a film's attributes: equal text means equal estimator.
  virtual std::string description() const = 0;

  // Optional capabilities; callers query these, never the integrator's type.
  /// This, if it learns from samples (training.h), otherwise null.
  virtual LearningIntegrator* learning() { return nullptr; }
  const LearningIntegrator* learning() const { return const_cast<Integrator*>(this)->learning(); }
  /// This, if it traces light (light_pass.h), otherwise null.
  virtual LightTracingIntegrator* light_tracing() { return nullptr; }
  const LightTracingIntegrator* light_tracing() const { return const_cast<Integrator*>(this)->light_tracing(); }
  /// Longest path length in edges if trace() fills PathContext::by_part.
  virtual std::optional<int> longest_path() const { return {}; }
  /// An integrator whose trace() takes the same samples and fills PathContext::by_part by Emitter::group(): part i is
  /// the light of groups[i], the last part that of all other lights. Null if it cannot separate them.
  virtual std::shared_ptr<Integrator> by_light(std::span<const std::string> /*groups*/) const { return nullptr; }
  /// An integrator whose samples, with the same random numbers, hold the part with at most two edges: directly visible
  /// emission and direct light. Null if there is no such part.
  virtual std::shared_ptr<Integrator> of_direct_light() const { return nullptr; }
  /// The integrators it stands for, the simplest first: a trial before the render chooses one
  /// (plans/integrator_trial.h), because this one does not trace. Empty for all others.
  virtual std::span<const std::shared_ptr<Integrator>> choices() const { return {}; }
  /// Warnings about what the integrator cannot render in the scene.
  virtual std::vector<std::string> blind_spots(const Scene& /*scene*/) const { return {}; }
  /// Whether it supports participating media.
  virtual bool sees_media() const { return false; }
  /// Call after the render.
  virtual IntegratorReport report() const { return {}; }
};

/// The first word of its description.
std::string registered_name(const Integrator& integrator);

/// Throws Error(kInput), "FILE:LINE: medium '…': …", if the scene has media and the integrator does not support them.
void require_sees_media(const Integrator& integrator, const Scene& scene);

inline PathContext::PathContext(const Integrator& integrator) : state(integrator.make_thread_state()) {}

}  // namespace covary
