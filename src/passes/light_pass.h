// SPDX-License-Identifier: Apache-2.0
// Light tracing: contributions of paths from the lights. An integrator that traces light (bidirectional path tracing)
// splits its techniques: camera samples take those that end in their own pixel. Those that connect a light path to the
// lens can end in any pixel; for them, a separate pass traces light paths into a light film (film/splat_layer.h) beside
// the films of camera samples. The image is what an estimator makes from the camera's films, plus the light film.
//
// Light paths are numbered, and every random number of a light path is a function of (seed, pass, path): the film is
// bit-identical for any number of threads and after interruptions.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "film/film.h"
#include "passes/integrator.h"
#include "passes/render_pass.h"
#include "passes/splat_filter.h"
#include "settings/settings.h"

namespace covary {

enum class LightTracing {
  kAuto,  ///< on, but not beside a pass with common random numbers
  kOn,
  kOff,
};

struct LightTracingSettings {
  LightTracing mode = LightTracing::kAuto;
  double paths_per_sample = 1;  ///< light paths for each camera sample, > 0
};

inline void declare(Settings& s, LightTracingSettings& v) {
  static constexpr std::pair<const char*, LightTracing> kModes[] = {
      {"auto", LightTracing::kAuto}, {"on", LightTracing::kOn}, {"off", LightTracing::kOff}};
  s.choice("light-tracing", v.mode, kModes, "Trace light paths in a separate pass; auto: unless numbers are common");
}

/// PassSettings::pass of light passes starts here, so that they share no numbers with passes of camera samples.
inline constexpr uint32_t kLightPass = 3u << 30;

/// Light paths to trace.
struct LightPaths {
  uint64_t seed = 0;
  uint32_t pass = kLightPass;
  uint64_t first = 0;  ///< number of the first path
  uint32_t count = 0;
  SplatFilter filter;
  CropWindow window;  ///< pixels that are rendered

  /// The random numbers of a path. Its walk uses those of subpath(Subpath::kLight), like the light subpath of a camera
  /// sample. Connecting vertex v of the walk to the lens uses these at vertex v: kLens for the point on the lens,
  /// kPixel for pixel_at().
  PathRandom random(uint64_t path) const { return {Sampling::kIndependent, seed, pass, 0, path}; }
  /// The pixel of a splat at a film position; weight 0 if it is in no rendered pixel, so that nothing more needs
  /// tracing. `u`: kPixel.
  SplatPixel pixel_at(Vec2 film, Vec2 u) const;
};

/// Contribution of a light path to the pixel (x, y) of the full frame.
struct LightSplat {
  uint64_t path;
  int x, y;
  /// Radiance of the pixel from this path alone: throughput * Camera importance / density * weight of the technique *
  /// SplatPixel::weight; not divided by the number of light paths.
  Spectrum value;
};

/// An integrator that traces light. After fix_light_tracing(), nothing that threads share changes.
class LightTracingIntegrator : public Integrator {
 public:
  using Integrator::light_tracing;
  LightTracingIntegrator* light_tracing() final { return this; }
  /// Sets how the integrator is used: `n_pixels` are rendered, and `beside_crn` says whether any use common random
  /// numbers. Called after prepare() and before description() or tracing; without it, no light is traced.
  void fix_light_tracing(uint64_t n_pixels, bool beside_crn);
  /// The decision of fix_light_tracing().
  bool wants_light_pass(bool beside_crn) const {
    return settings_.mode == LightTracing::kOn || (settings_.mode == LightTracing::kAuto && !beside_crn);
  }
  /// Whether there is a light pass beside the camera's. If not, techniques that connect a light path to the lens have
  /// weight 0.
  bool traces_light() const { return paths_per_spp_ > 0; }
  /// Light paths per sample in each rendered pixel: the number of samples of lens-connecting techniques per pixel for
  /// each sample of other techniques (film density 1 per pixel area). Used for MIS weights. 0 if no light is traced.
  double light_paths_per_spp() const { return paths_per_spp_; }

  /// Appends the splats of the paths, grouped by path, in an order that depends on the path alone; paths may come in
  /// any order. A path's splats do not depend on which others are traced with it. Non-finite and negative values are
  /// passed on, for the pass to count them. Thread-safe.
  virtual void trace_light_paths(const Scene& scene, const LightPaths& paths, std::vector<LightSplat>& splats,
                                 PathContext& context) const = 0;

 protected:
  explicit LightTracingIntegrator(const LightTracingSettings& settings) : settings_(settings) {}
  /// For description(): "light_tracing=on light_paths_per_spp=3072". The number is included because weights depend on
  /// it, also those of camera samples.
  std::string light_tracing_text() const;

 private:
  LightTracingSettings settings_;
  double paths_per_spp_ = 0;
};

/// The integrator if it traces light, otherwise null.
const LightTracingIntegrator* light_tracer(const Integrator& integrator);

/// Traces light paths into `film` until it has settings.spp samples, at most settings.limit, or the stop flag or
/// settings.seconds end it. A sample of a light film is a bundle of kBundlePaths light paths; these numbers are
/// multiples of the film's groups, and settings.pass is at least kLightPass. `sampling`, `estimate` and `learner` are
/// unused. Bundles come in rounds: an interrupted round is dropped. In the result, `n_samples` counts light paths, as
/// `progress` does, and a BadSample's `sample` is the number of one.
PassResult render_light_pass(const Scene& scene, const LightTracingIntegrator& integrator, const PassSettings& settings,
                             Film& film);

/// Samples of a light film at the end of the round that begins with `count`, for a film of `groups` groups: first one
/// per group, then four times as many each time, later the next multiple of SplatLayer's rounds.
uint32_t light_round_end(uint32_t count, int groups);

/// The contributions of one light path to a film with this crop window in render_light_pass().
struct ReplayedLightPath {
  std::vector<LightSplat> splats;
  uint64_t n_rays = 0;
};
ReplayedLightPath replay_light_path(const Scene& scene, const LightTracingIntegrator& integrator,
                                    const PassSettings& settings, const CropWindow& window, uint64_t path);

}  // namespace covary
