// SPDX-License-Identifier: Apache-2.0
// A pass: renders samples of one scene into a film. The film's own counts say what is left to do, so starting, resuming
// and adding samples are the same operation, and the result has the same bits however the work was split: every sample
// is a function of its address (core/random.h), and a pixel's samples are added one by one in order. Pixels may have
// different numbers and targets of samples.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <functional>
#include <numeric>
#include <span>
#include <utility>
#include <vector>

#include "film/film.h"
#include "passes/integrator.h"

namespace covary {

/// Target number of samples of a film's pixels: one number for all, or a map with a number for each.
class SampleTarget {
 public:
  SampleTarget(uint32_t all = 0) : largest_(all) {}  // NOLINT(google-explicit-constructor): the usual case is a number
  /// `map`: row by row, as many as the film has pixels; zeros are allowed.
  explicit SampleTarget(std::vector<uint32_t> map)
      : largest_(map.empty() ? 0 : *std::max_element(map.begin(), map.end())), map_(std::move(map)) {}

  /// Samples of the pixel with this index, row by row.
  uint32_t at(size_t pixel) const { return map_.empty() ? largest_ : map_[pixel]; }
  /// The largest number of any pixel.
  uint32_t largest() const { return largest_; }
  bool is_map() const { return !map_.empty(); }
  /// Mean over all pixels.
  double mean() const {
    return map_.empty() ? largest_ : std::accumulate(map_.begin(), map_.end(), 0.0) / static_cast<double>(map_.size());
  }
  /// Whether it is a number, or a map of the film's size.
  bool fits(const Film& film) const { return map_.empty() || map_.size() == film.counts().size(); }

  /// Samples that `film` still needs, over all pixels, if no pixel gets more than `limit`.
  uint64_t missing(const Film& film, uint32_t limit = UINT32_MAX) const {
    uint64_t sum = 0;
    for (size_t i = 0; i < film.counts().size(); ++i) {
      const uint32_t wanted = std::min(at(i), limit), count = film.counts()[i];
      sum += wanted - std::min(count, wanted);
    }
    return sum;
  }
  /// The largest N such that every pixel of `film` has at least N samples or its target; largest() if all have reached
  /// their targets.
  uint32_t reached(const Film& film) const {
    uint32_t fewest = largest_;
    for (size_t i = 0; i < film.counts().size(); ++i)
      if (film.counts()[i] < at(i)) fewest = std::min(fewest, film.counts()[i]);
    return fewest;
  }

 private:
  uint32_t largest_;
  std::vector<uint32_t> map_;
};

/// `samples` in the centre pixel of each stride x stride square, none elsewhere.
inline SampleTarget one_in_each_square(const CropWindow& window, int stride, uint32_t samples) {
  if (stride == 1) return samples;
  std::vector<uint32_t> map(static_cast<size_t>(window.width) * window.height);
  for (int y = stride / 2; y < window.height; y += stride)
    for (int x = stride / 2; x < window.width; x += stride) map[static_cast<size_t>(y) * window.width + x] = samples;
  return SampleTarget(std::move(map));
}

class LearningIntegrator;

/// The value of a pixel, computed from all its samples jointly. Called from several threads at once.
using PixelEstimate = std::function<Spectrum(std::span<const CameraSample>)>;

/// "independent" or "crn": attribute of films.
const char* sampling_name(Sampling sampling);
/// "independent" or "sobol".
const char* sampler_name(Sampler sampler);

struct PassSettings {
  Sampling sampling = Sampling::kIndependent;
  Sampler sampler = Sampler::kIndependent;
  /// Groups of the film; with Sampler::kSobol, sample s uses point s / groups of the sequences of group s mod groups.
  int groups = 1;
  uint64_t seed = 0;
  uint32_t pass = 0;  ///< index in the plan; passes of one plan never share random numbers
  SampleTarget spp;   ///< samples per pixel to reach
  /// No pixel gets more samples than this; the rest is left for later calls.
  uint32_t limit = UINT32_MAX;
  FilterSettings filter;
  /// If set, replaces the mean. The samples of a pixel are then taken in one go, and a thread holds all spp of them;
  /// the film has one group, its pixels are finished or have no samples, and `limit` is unused.
  PixelEstimate estimate;
  /// The integrator of this pass if it learns from all of these samples (passes/training.h), otherwise null. The film
  /// has as many samples in each pixel as were learnt from so far.
  LearningIntegrator* learner = nullptr;
  /// Weight of an error in each channel of each pixel of the film, row by row, for a learner; empty: 1. `checkpoint`
  /// may set it between waves.
  std::span<const Spectrum> importance;
  double seconds = 0;  ///< if > 0, stop after this time, even within a wave
  /// Set from a signal handler to stop at the next tile.
  const std::atomic<bool>* stop = nullptr;
  /// Called from any thread after each tile with the samples done since the start; must be thread-safe.
  std::function<void(uint64_t done, uint64_t total)> progress;
  /// Called between waves, and with `estimate` about twice a second, when no thread works on the film, so that it may
  /// be written.
  std::function<void()> checkpoint;
};

/// A sample that is not finite, or negative if Integrator::allows_negative() is false. It enters the film as black and
/// is counted.
struct BadSample {
  int x, y;  ///< pixel in the full frame
  uint64_t sample;
  Spectrum value;
};

struct PassResult {
  uint64_t n_samples = 0;  ///< taken by this call
  uint64_t n_rays = 0;     ///< camera, BSDF and shadow rays
  uint64_t n_not_finite = 0, n_negative = 0;
  std::vector<BadSample> bad_samples;  ///< the first few, ordered by pixel and sample
  bool complete = false;               ///< every pixel has min(settings.spp, settings.limit) samples
  double seconds = 0;
  double estimate_seconds = 0;  ///< part of `seconds`: the threads' time in settings.estimate
};

/// Renders until every pixel of `film` has settings.spp samples, at most settings.limit, or until time or the stop flag
/// ends it.
PassResult render_pass(const Scene& scene, const Integrator& integrator, const PassSettings& settings, Film& film);

/// The sample that render_pass() takes for (x, y, sample), before tracing; x, y in the full frame.
CameraSample camera_sample(const Scene& scene, const PassSettings& settings, int x, int y, uint64_t sample);

/// The value of one sample and its film position: what render_pass() adds for (x, y, sample).
struct ReplayedSample {
  Vec2 position;
  Spectrum value;
  uint64_t n_rays;
};
ReplayedSample replay_sample(const Scene& scene, const Integrator& integrator, const PassSettings& settings, int x,
                             int y, uint64_t sample);

/// Samples per pixel at the end of a wave that begins with `count`, for a film of `groups` groups: twice as many,
/// starting with one in each group, and later the next multiple of about 16. So if time runs out within a wave, no
/// pixel has less than half of the samples of another.
uint32_t wave_end(uint32_t count, int groups);

/// Position of a sample in pixels of the full frame, distributed around the pixel's centre like the filter, or like its
/// magnitude if it has negative lobes.
Vec2 film_position(const FilterSettings& filter, int x, int y, const PathRandom& random);
/// The factor on what the film gets of the sample there: filter over density, 1 without negative lobes.
float film_weight(const FilterSettings& filter, const PathRandom& random);

}  // namespace covary
