// SPDX-License-Identifier: Apache-2.0
// Executes a plan on a scene: the single entry point for the command line, tests and other programs. It prints nothing,
// handles no signals, and neither reads nor sets global state.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "passes/light_pass.h"
#include "passes/training_image.h"
#include "plans/plan.h"
#include "plans/render_request.h"
#include "plans/time_budget.h"
#include "risk/predicted_error.h"

namespace covary {

/// Phases of a render's progress: choosing an integrator or, with a time limit, measuring what parts of the render
/// take; the integrator's training; auxiliary images; samples; the image of their films; files. Rendering and
/// estimating may repeat, with RenderRequest::until.
enum class RenderStage { kTrial, kTraining, kAuxiliary, kRendering, kEstimating, kWriting };
/// The name of a phase for people; `estimating`: of kEstimating, since estimators do different things.
const char* name_of(RenderStage stage, const char* estimating);

/// Callbacks of a render. Any of them may be empty.
struct RenderCallbacks {
  /// The render ends at the next tile once this is true; may be set from a signal handler.
  const std::atomic<bool>* stop = nullptr;
  std::function<void(RenderStage)> stage;  ///< a phase begins
  /// After each estimate with an error: the predicted error, that of blocks with RenderRequest::until_in_blocks.
  std::function<void(const PredictedError&)> predicted;
  /// After each tile, from any thread; must be thread-safe. Counts the samples and light paths of the current phase; of
  /// kAuxiliary, pixels.
  std::function<void(uint64_t done, uint64_t total)> progress;
  /// Between waves, when films may be read; about twice a second in passes of a single wave.
  std::function<void(std::span<const Pass>)> wave;
  std::function<void(const std::string&)> warning;
  /// With `resume`: samples per pixel, of all passes of camera samples, that earlier calls had taken.
  std::function<void(double samples)> resumed;

  // For somebody who watches. None of these changes the bits of an image with the same samples.
  /// Waves of 1, 2, 4, … samples per pixel, of about a second at most, so that there is soon something to see.
  bool small_waves = false;
  /// Once the images that guide a denoiser are there; they remain until the render ends.
  std::function<void(const std::map<std::string, Image>&)> auxiliary;
  /// After each estimate of the whole image, with its predicted error, if any.
  std::function<void(const EstimatorResult&, const std::optional<PredictedError>&)> estimated;
  /// Asked between waves: pixels, in the frame, that get their samples before all others.
  std::function<std::optional<CropWindow>()> region;
  /// Asked when all samples are there, unless there is a time limit: may raise `spp`, or set a smaller `until`.
  std::function<void(RenderRequest&)> goal;
  /// If true, a render that `stop` ends still makes the whole image, however long that takes.
  const std::atomic<bool>* whole_image = nullptr;
};

struct RenderSeconds {
  double auxiliary = 0;  ///< of rendering auxiliary images
  double train = 0;      ///< of the integrator's training
  double surrogate = 0;  ///< part of it: computing the importance of pixels
  double solve = 0;      ///< part of it: building the integrator's data structures from the samples
  double trial =
      0;  ///< choosing an integrator by trial and, with a time limit, measuring what the parts of the render take
  double estimate = 0;  ///< of the final estimate, after the passes
  double write = 0;
  /// Processor time of everything but reading the scene and writing files; of samples, like the passes, with that of
  /// earlier calls. Programs that share the machine take the clock's time, but not this.
  double processor = 0;
  double limited = 0;  ///< time that counts towards the limit, in this call: all of it
};

/// The result of an integrator's trial.
struct IntegratorTrial {
  std::string integrator;  ///< registered name
  /// Variance of a sample, relative to the brightness as in relMSE, and rays per sample; 0: not tried.
  double variance = 0, rays = 0;
  std::string left_out;  ///< why it was not tried
};

/// The result of a plan.
struct RenderResult {
  /// If the scene's integrator stands for several: their trials, in order, and the registered name of the chosen one.
  std::vector<IntegratorTrial> trials;
  std::string chosen;
  std::shared_ptr<const Integrator> integrator;  ///< of the last passes, with what it has learnt
  std::vector<Pass> passes;
  /// If the film itself is the image, at most its standard error. Empty for an interrupted render in
  /// which some pixel of a film has no samples, or whose image takes more than seconds (RenderCallbacks::whole_image
  /// lets it take as long as it needs); picture() is the mean then.
  EstimatorResult image;
  std::optional<PredictedError> predicted;  ///< if there is a standard error
  double predicted_blocks = 0;              ///< of predicted_error.h, likewise
  /// Image of the integrator's training samples, if they are part of the image (Plan::takes_training).
  TrainingImage training;
  std::map<std::string, Image> aovs;
  RenderSeconds seconds;
  bool complete = false;              ///< all passes have the samples that were asked for
  std::optional<TimeChoice> of_time;  ///< with a time limit, if its image can be made again without one
  std::optional<bool> until_reached;  ///< whether the predicted error reached the target, if there was one
  bool interrupted = false;           ///< by the stop token
  double resumed_samples = 0;         ///< per pixel, that earlier calls had taken (RenderCallbacks::resumed)
  double preview_stops = 0;           ///< by which the PNG is brighter than the image
  std::string kept;                   ///< after an interruption: the file or folder with the films, empty if none

  template <typename F>
  double sum(F value) const {
    double total = 0;
    for (const Pass& pass : passes) total += static_cast<double>(value(pass));
    return total;
  }
  /// The same for camera samples only.
  template <typename F>
  double camera_sum(F value) const {
    return sum([&](const Pass& pass) { return pass.plan.light ? 0 : value(pass); });
  }
  double samples_per_pixel() const {
    return camera_sum([](const Pass& p) { return p.film.mean_count(); });
  }
  /// Time of the passes and auxiliary images, without estimates inside passes.
  double render_seconds() const {
    return seconds.auxiliary + sum([](const Pass& p) { return p.result.seconds - p.result.estimate_seconds; });
  }
  /// Time to compute the image, both during and after the passes.
  double estimate_seconds() const {
    return seconds.estimate + sum([](const Pass& p) { return p.result.estimate_seconds; });
  }
  /// The image, however computed; for an interrupted render, the mean of all samples so far.
  Image picture() const;
};

/// The images of RenderResult::aovs that guide a denoiser; null if missing.
Features features_among(const std::map<std::string, Image>& aovs);

/// The sampler of camera samples: the request's, or the equivalent of the scene's: independent random numbers for
/// `independent` or none, Sobol' points for each of Mitsuba's stratified and low-discrepancy samplers.
Sampler sampler_of(const LoadedScene& scene, const RenderRequest& request);

/// Renders, estimates and, if the request names files, writes. `scene` must have been loaded with an integrator
/// (integrator_choice.h). An interrupted render leaves films that can be resumed and, if any sample was taken, their
/// image, marked by the attribute covary:complete=false. Throws Error(kUsage) for a request that does not fit the scene
/// or plan or needs more memory than the machine has, Error(kInput) for films of another render, and Error(kIo).
RenderResult render(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                    const RenderCallbacks& callbacks = {});

/// The mean of all samples so far, plus the light film: an image for a viewer during the passes.
Image preview_of(std::span<const Pass> passes);

/// One sample of a pass.
struct SampleAddress {
  Sampling sampling = Sampling::kIndependent;
  uint32_t pass = 0;  ///< PassPlan::number
  int x = 0, y = 0;   ///< pixel in the full frame
  uint64_t sample = 0;
  std::optional<int> groups;  ///< of the film; needed if sampler_of() is Sampler::kSobol
};
/// The values of the samples, as render() adds them to films of the plan with this request's seed, filter and crop.
/// Throws Error(kUsage) for a pixel outside the frame, and if the number of groups is needed but missing.
std::vector<ReplayedSample> replay(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                                   std::span<const SampleAddress> addresses);
/// A single one.
ReplayedSample replay(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                      const SampleAddress& address);

/// What the light path with this number adds to the film of the plan's light pass. Throws Error(kUsage) if there is
/// none.
ReplayedLightPath replay_light(const LoadedScene& scene, const Plan& plan, const RenderRequest& request, uint64_t path);

}  // namespace covary
