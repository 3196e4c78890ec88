// SPDX-License-Identifier: Apache-2.0
#include "render_progress.h"

#include <tbb/global_control.h>

#include <algorithm>

#include "plans/budget.h"

namespace covary {
namespace {

/// Processor time of the estimate for a pixel, with a neural network and without (docs/methods/denoising.md).
constexpr double kSecondsWithNetwork = 12e-6, kSecondsWithFilters = 5e-6;
/// A pixel of the auxiliary images, 16 to 64 rays, takes about as long as so many samples.
constexpr double kAuxiliaryInSamples = 4;
constexpr double kUnknownSamples = 1e15;  // a time limit ends them

double expected_estimate(const RenderOptions& options, double n_pixels) {
  if (!options.settings.denoising.denoises()) return 0;
  const size_t threads = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
  const bool network = !estimator_of(options).network.empty();
  return n_pixels * (network ? kSecondsWithNetwork : kSecondsWithFilters) / static_cast<double>(threads);
}

}  // namespace

std::string estimate_name(const RenderOptions& options) {
  if (options.settings.denoising.denoises()) return "denoising";
  return estimator_of(options).passes == EstimatorPasses::kPair ? "combining" : "measuring the error";
}

RenderProgress::RenderProgress(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                               ProgressLine& line)
    : options_(options), line_(line) {
  const CropWindow window = window_of(scene, request);
  n_pixels_ = static_cast<double>(window.width) * window.height;
  n_samples_ = request.seconds > 0 && !request.spp ? kUnknownSamples : n_pixels_ * first_budget(scene, request);
  estimate_seconds_ = expected_estimate(options, n_pixels_);
  line.limit(request.seconds);
  line.aim(request.until);
}

void RenderProgress::begin(RenderStage stage) {
  if (stage_ == RenderStage::kEstimating) estimate_seconds_ = of_stage_.seconds();
  stage_ = stage;
  of_stage_ = Stopwatch();
  line_.begin(name_of(stage, estimate_name(options_).c_str()), stage == RenderStage::kRendering ? rendered_.load() : 0);
  if (stage == RenderStage::kEstimating) line_.expect(estimate_seconds_);
  if (stage == RenderStage::kAuxiliary) line_.later(n_samples_ / kAuxiliaryInSamples, estimate_seconds_);
  if (stage == RenderStage::kRendering) line_.later(0, estimate_seconds_);
}

void RenderProgress::update(uint64_t done, uint64_t total) {
  if (stage_ == RenderStage::kRendering) rendered_ = done;
  const bool is_open = stage_ == RenderStage::kRendering && n_samples_ == kUnknownSamples;
  line_.update(done, is_open ? 0 : total);
}

}  // namespace covary
