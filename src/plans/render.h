// SPDX-License-Identifier: Apache-2.0
// Renders a scene by a plan: the one entry point of the command line, of tests and of other programs. Nothing is
// printed, no signal handled, and nothing global read or set.
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
#include "risk/predicted_error.h"

namespace covary {

/// What a render does for a while. Rendering and estimating may come again, with RenderRequest::until.
enum class RenderStage { kTraining, kRendering, kEstimating, kWriting };

/// What the caller hears of a render. Any of them may be empty.
struct RenderCallbacks {
  /// The render ends at the next tile once this is true; may be set from a signal handler.
  const std::atomic<bool>* stop = nullptr;
  std::function<void(RenderStage)> stage;  ///< one begins
  /// After each estimate that has one: the predicted error, that of blocks with RenderRequest::until_in_blocks.
  std::function<void(const PredictedError&)> predicted;
  /// After each tile, from any thread; must be thread-safe. Counts the samples and light paths of the current phase.
  std::function<void(uint64_t done, uint64_t total)> progress;
  /// Between waves, when films may be read, and once in about half a second in passes of a single wave.
  std::function<void(std::span<const Pass>)> wave;
  std::function<void(const std::string&)> warning;
};

struct RenderSeconds {
  double auxiliary = 0;  ///< of rendering auxiliary images
  double train = 0;      ///< of the integrator's training
  double surrogate = 0;  ///< part of it: of making the importance of pixels
  double solve = 0;      ///< part of it: of making of samples what the integrator reads
  double trial =
      0;  ///< of finding out which integrator is best, and, for a time limit, how fast passes and estimator are
  double estimate = 0;  ///< after the passes
  double write = 0;
  double limited = 0;  ///< of what the time limit counts, in this call
};

/// What a trial found of an integrator.
struct IntegratorTrial {
  std::string integrator;  ///< registered name
  /// Variance of a sample, relative to the brightness as in relMSE, and rays that a sample takes; 0: not tried.
  double variance = 0, rays = 0;
  std::string left_out;  ///< why it was not tried
};

/// What has become of a plan.
struct RenderResult {
  /// Where the scene's integrator stands for several, in its order; and the registered name of the one that was chosen.
  std::vector<IntegratorTrial> trials;
  std::string chosen;
  std::shared_ptr<const Integrator> integrator;  ///< of the last passes, with what it has learnt
  std::vector<Pass> passes;
  /// Where the film alone is the image, at most its standard error. Empty of a render that was interrupted before every
  /// pixel of every film had samples.
  EstimatorResult image;
  std::optional<PredictedError> predicted;  ///< where there is a standard error
  double predicted_blocks = 0;              ///< of predicted_error.h, there
  /// Image of the samples of the integrator's training, where they are a part of the image (Plan::takes_training).
  TrainingImage training;
  std::map<std::string, Image> aovs;
  RenderSeconds seconds;
  bool complete = false;              ///< all passes have the samples that were planned
  std::optional<bool> until_reached;  ///< whether the predicted error is at most the wanted one, where one was
  bool interrupted = false;           ///< by the stop token
  std::string kept;  ///< after an interruption: the file or folder that holds the films, empty where none does

  template <typename F>
  double sum(F value) const {
    double total = 0;
    for (const Pass& pass : passes) total += static_cast<double>(value(pass));
    return total;
  }
  /// The same of camera samples alone.
  template <typename F>
  double camera_sum(F value) const {
    return sum([&](const Pass& pass) { return pass.plan.light ? 0 : value(pass); });
  }
  double samples_per_pixel() const {
    return camera_sum([](const Pass& p) { return p.film.mean_count(); });
  }
  /// Time of the passes and auxiliary images, without what estimates inside passes took.
  double render_seconds() const {
    return seconds.auxiliary + sum([](const Pass& p) { return p.result.seconds - p.result.estimate_seconds; });
  }
  /// Time of making the image, inside the passes and of them.
  double estimate_seconds() const {
    return seconds.estimate + sum([](const Pass& p) { return p.result.estimate_seconds; });
  }
  /// The image, whoever made it; of an interrupted render the mean of all samples so far.
  Image picture() const;
};

/// The images of RenderResult::aovs that guide a denoiser; null where they are not there.
Guides guides_among(const std::map<std::string, Image>& aovs);

/// The sampler of camera samples: the request's, or else what stands for that of the scene: independent numbers for
/// `independent` and where the scene has none, Sobol' points for each of Mitsuba's stratified and low-discrepancy ones.
Sampler sampler_of(const LoadedScene& scene, const RenderRequest& request);

/// Renders, estimates and, where the request names files, writes. `scene` was loaded with an integrator
/// (integrator_choice.h). An interrupted render leaves what there is: films that can be continued and, where any sample
/// was taken, the image of these, marked by the attribute covary:complete=false. Throws Error(kUsage) for a request
/// that does not fit the scene or plan or needs more memory than the machine has, Error(kInput) for films that are not
/// those of this render, and Error(kIo).
RenderResult render(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                    const RenderCallbacks& callbacks = {});

/// The mean of all samples so far, and the light film: a picture for a viewer while passes go on.
Image preview_of(std::span<const Pass> passes);

/// One sample of a pass.
struct SampleAddress {
  Sampling sampling = Sampling::kIndependent;
  uint32_t pass = 0;  ///< PassPlan::number
  int x = 0, y = 0;   ///< pixel in the full frame
  uint64_t sample = 0;
  std::optional<int> groups;  ///< of the film; needed where sampler_of() is Sampler::kSobol
};
/// The values of the samples, as render() adds them to films of the plan with this request's seed, filter and crop.
/// Throws Error(kUsage) for a pixel outside the frame, and where the number of groups is needed and not given.
std::vector<ReplayedSample> replay(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                                   std::span<const SampleAddress> addresses);
/// A single one.
ReplayedSample replay(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                      const SampleAddress& address);

/// What the light path of this number adds to the film of the plan's light pass. Throws Error(kUsage) where there is
/// none.
ReplayedLightPath replay_light(const LoadedScene& scene, const Plan& plan, const RenderRequest& request, uint64_t path);

}  // namespace covary
