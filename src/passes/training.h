// SPDX-License-Identifier: Apache-2.0
// Integrators that learn: in some waves of a pass they collect from samples what later samples use, e.g. sums in
// spatial cells, or directional mixtures for guiding.
//
//     wave of 1 sample per pixel, wave of 1 more, of 2, of 4, …          (render_pass.h: wave_end)
//       trace()        threads record into their states
//       take_record()  the samples of a tile, taken by one thread in a fixed order, become one record
//       absorb()       records in the order of tiles: sums are bit-identical for any number of threads
//       end_wave()     builds what the next wave's trace() reads
//     freeze()         from here on, a sample is a function of its address alone, as for other integrators
//
// The samples of a wave depend only on earlier waves, so their mean is unbiased and they may stay in the film
// (PassSettings::learner). train() below, with which a planned render begins, makes an image from them
// (training_image.h). The hash of the frozen state becomes a film attribute: films with different training cannot be
// continued, but may be merged, because each is unbiased.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"
#include "passes/training_image.h"

namespace covary {

/// The training data from one tile's samples.
class TrainingRecord {
 public:
  virtual ~TrainingRecord() = default;
};

struct GuideProbe;

class LearningIntegrator : public Integrator {
 public:
  using Integrator::learning;
  LearningIntegrator* learning() final { return this; }
  /// Samples per pixel of the training, according to the parameters; 0: it is frozen as it is.
  virtual uint32_t training_spp() const = 0;
  /// How the waves of the training become an image.
  virtual WaveWeights wave_weights() const { return WaveWeights::kVariance; }
  /// Samples per pixel of the training after which the importance of each pixel (PassSettings::importance) is computed
  /// from the image so far; 0: not needed.
  virtual uint32_t pilot_spp() const { return 0; }
  /// Whether the importance is computed again after each later wave, from all samples so far.
  virtual bool pilot_goes_on() const { return true; }
  /// Whether Open Image Denoise denoises that image for it, instead of a built-in filter.
  virtual bool pilot_by_oidn() const { return false; }
  /// Maximum memory of the training in bytes; 0: little.
  virtual size_t training_memory() const { return 0; }
  /// What trace() has recorded in a thread's state since the last call, or null. Not called when frozen. Thread-safe.
  virtual std::unique_ptr<TrainingRecord> take_record(ThreadState& state) const = 0;
  /// Adds a record. Called by one thread at a time, in the order of tiles, never null; other threads may be tracing.
  virtual void absorb(const TrainingRecord& record) = 0;

  /// Whether the training can be saved and loaded, by the two functions below.
  virtual bool keeps_training() const { return false; }
  /// The training as bytes; after freeze().
  virtual std::string trained_bytes() const { return {}; }
  /// Loads trained_bytes() instead of training; after prepare(). Throws Error(kInput) for other bytes; `where` names
  /// their source.
  virtual void use_bytes(std::string_view /*bytes*/, const std::string& /*where*/) {}
  /// Registered name and settings.
  virtual std::string settings_text() const = 0;

  /// Whether it has learnt functions of directions, for probe().
  virtual bool learns_directions() const { return false; }
  /// The learnt functions at the first surface along `ray`, by training.h; empty if there is no surface.
  virtual std::optional<GuideProbe> probe(const Scene& scene, const Ray& ray, int height, uint32_t spp,
                                          uint64_t seed) const;

  /// Discards the training, if any.
  void restart();
  /// Ends a wave after which each pixel has taken `spp` samples; called when no thread traces.
  void end_wave(uint32_t spp);
  /// Ends the training.
  void freeze();

  /// Samples per pixel learnt from so far.
  uint32_t trained_spp() const { return trained_spp_; }
  bool frozen() const { return frozen_; }
  /// Seconds since restart() spent on building what trace() reads.
  double update_seconds() const { return update_seconds_; }
  /// settings_text() and the hash of the frozen state; "untrained" before.
  std::string description() const final;
  /// Hash of the frozen state, or "untrained".
  std::string training_text() const;

 protected:
  /// Called by restart(): back to the untrained state.
  virtual void on_restart() = 0;
  /// Builds what trace() reads from everything absorbed; may use many threads, whose number must not change a bit.
  virtual void update() = 0;
  /// Called by freeze(): nothing is recorded from here on, and data that only training needs can be freed.
  virtual void on_freeze() {}
  /// Hash (core/content_hash.h) of all learnt data that trace() reads.
  virtual uint64_t state_hash() const = 0;

 private:
  uint32_t trained_spp_ = 0;
  bool frozen_ = false;
  uint64_t hash_ = 0;
  double update_seconds_ = 0;
};

/// PassSettings::pass of training, so that it shares no numbers with the passes of a plan.
inline constexpr uint32_t kTrainingPass = 1u << 31;

struct TrainingSettings {
  CropWindow window;  ///< pixels of the training samples, a part of the camera's frame
  FilterSettings filter;
  const std::atomic<bool>* stop = nullptr;                      ///< as in PassSettings
  std::function<void(uint64_t done, uint64_t total)> progress;  ///< as in PassSettings
  /// Computes the importance of each pixel from the film after pilot_spp() samples, and after later waves; empty: 1
  /// everywhere.
  std::function<std::vector<Spectrum>(const Film&)> importance;
  /// PassSettings::seed of the training: renders of different seeds learn from different samples.
  uint64_t seed = 0;
  TrainingImage* image = nullptr;  ///< if set, receives the image of the samples
  int stride = 1;                  ///< trains on one pixel in each square of this side; must be 1 with an `image`
};

/// Trains a prepared integrator from scratch, with training_spp() independent samples in each pixel, and freezes it.
/// False if stopped before that; it can be trained again.
bool train(const Scene& scene, LearningIntegrator& integrator, const TrainingSettings& settings);

// The knowledge of a guided integrator at a surface, as functions of direction: latitude-longitude images around the y
// axis.

/// Row 0 is +y. Column 0 begins at +x and turns towards +z.
struct GuideProbe {
  Vec3 position;
  Image radiance;  ///< incident radiance, by brute force
  Image density;   ///< density of the next direction per unit solid angle, delta lobes excluded; grey
  Image control;  ///< Σ_k β_k N_k λ_k of the leaf's control variate per unit solid angle, scaled; RGB, can be negative
};

/// Direction of the point (x, y) of a probe's image, in [0, 1]².
Vec3 probe_direction(float x, float y);

}  // namespace covary
