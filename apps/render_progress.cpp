// SPDX-License-Identifier: Apache-2.0
#include "render_progress.h"

#include <tbb/global_control.h>

#include <algorithm>

#include "core/processor_time.h"
#include "plans/budget.h"

namespace covary {
namespace {

/// Processor time of the estimate for a pixel, with a neural network and without (docs/methods/denoising.md).
constexpr double kSecondsWithNetwork = 12e-6, kSecondsWithFilters = 5e-6;
/// A pixel of the auxiliary images, 16 to 64 rays, takes about as long as so many samples.
constexpr double kAuxiliaryInSamples = 4;
constexpr double kUnknownSamples = 1e15;  // a time limit ends them

constexpr double kTellingSeconds = 0.5;

double work_of_estimate(const RenderOptions& options, double n_pixels) {
  if (!options.settings.denoising.denoises()) return 0;
  return n_pixels * (estimator_of(options).network.empty() ? kSecondsWithFilters : kSecondsWithNetwork);
}

}  // namespace

std::string estimate_name(const RenderOptions& options) {
  if (options.settings.denoising.denoises()) return "denoising";
  return estimator_of(options).pair() ? "combining" : "measuring the error";
}

RenderProgress::RenderProgress(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                               ProgressLine& line)
    : options_(options), line_(line) {
  const CropWindow window = window_of(scene, request);
  n_pixels_ = static_cast<double>(window.width) * window.height;
  const bool is_unknown = request.seconds > 0 && !request.spp;
  n_samples_ = is_unknown ? kUnknownSamples : n_pixels_ * samples_before_check(scene, make_plan(options), request);
  estimate_work_ = work_of_estimate(options, n_pixels_);
  threads_ = static_cast<int>(tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism));
  auxiliary_begun_ = !request.aovs && !request.alpha && !estimator_of(options).reads_features;
  line.limit(request.seconds);
  line.aim(request.until);
}

RenderProgress::~RenderProgress() { line_.expect(nullptr); }

double RenderProgress::estimate_seconds() const {
  if (last_estimate_) return *last_estimate_;
  const double processor = processor_before_ ? processor_seconds() - *processor_before_ : 0;
  return clock_seconds(estimate_work_, threads_, processor, processor_before_ ? of_work_.seconds() : 0);
}

/// Of the estimate that has begun: as the processor time that it gets suggests, once there is some.
double RenderProgress::estimate_left() const {
  const double taken = of_stage_.seconds(), got = processor_seconds() - processor_at_stage_;
  if (last_estimate_ || taken < kTellingSeconds) return estimate_seconds() - taken;
  return clock_seconds(estimate_work_ - got, threads_, got, taken);
}

void RenderProgress::tell_later() {
  line_.later(later_samples_, estimate_seconds());
  told_ = Stopwatch();
}

void RenderProgress::begin(RenderStage stage) {
  const std::lock_guard lock(telling_);
  line_.begin(name_of(stage, estimate_name(options_).c_str()), stage == RenderStage::kRendering ? rendered_.load() : 0);
  if (stage_ == RenderStage::kEstimating) last_estimate_ = of_stage_.seconds();
  stage_ = stage;
  of_stage_ = Stopwatch(), processor_at_stage_ = processor_seconds();
  if (stage == RenderStage::kEstimating) line_.expect([this] { return estimate_left(); });
  if (stage != RenderStage::kAuxiliary && stage != RenderStage::kRendering) return;
  if (!processor_before_) processor_before_ = processor_seconds(), of_work_ = Stopwatch();
  auxiliary_begun_ = auxiliary_begun_ || stage == RenderStage::kAuxiliary;
  // The first samples come before the auxiliary images.
  if (stage == RenderStage::kRendering) later_samples_ = auxiliary_begun_ ? 0 : n_pixels_ * kAuxiliaryInSamples;
  if (stage == RenderStage::kAuxiliary) later_samples_ = n_samples_ / kAuxiliaryInSamples;
  tell_later();
}

void RenderProgress::update(uint64_t done, uint64_t total) {
  if (stage_ == RenderStage::kRendering) rendered_ = done;
  const bool is_open = stage_ == RenderStage::kRendering && n_samples_ == kUnknownSamples;
  line_.update(done, is_open ? 0 : total);
  const std::unique_lock lock(telling_, std::try_to_lock);
  const bool is_work = stage_ == RenderStage::kRendering || stage_ == RenderStage::kAuxiliary;
  if (lock && is_work && told_.seconds() > kTellingSeconds) tell_later();
}

}  // namespace covary
