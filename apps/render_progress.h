// SPDX-License-Identifier: Apache-2.0
// The phases of a render on its progress line.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>

#include "plans/render.h"
#include "progress.h"
#include "render_options.h"

namespace covary {

/// What making the image of its samples is called: "denoising", "combining" or "measuring the error".
std::string estimate_name(const RenderOptions& options);

/// Shows a render's callbacks, with the time left over all phases: as far as later phases have not begun, from what
/// they usually take, and from how much of the processors other programs leave.
class RenderProgress {
 public:
  RenderProgress(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                 ProgressLine& line);
  ~RenderProgress();
  RenderProgress(const RenderProgress&) = delete;
  RenderProgress& operator=(const RenderProgress&) = delete;

  void begin(RenderStage stage);
  /// Thread-safe.
  void update(uint64_t done, uint64_t total);
  void predicted(const PredictedError& error) { line_.toward(error); }

 private:
  double estimate_seconds() const;
  double estimate_left() const;
  void tell_later();

  const RenderOptions& options_;
  ProgressLine& line_;
  double n_pixels_, n_samples_;          ///< samples: of the whole render, as far as known
  double later_samples_ = 0;             ///< work after the phase takes as long as so many of its units
  double estimate_work_;                 ///< processor time expected of the estimate
  std::optional<double> last_estimate_;  ///< seconds that it took
  int threads_;
  std::atomic<RenderStage> stage_ = RenderStage::kTrial;
  bool auxiliary_begun_;  ///< their phase, or there is none
  Stopwatch of_stage_;
  double processor_at_stage_ = 0;
  std::optional<double> processor_before_;  ///< when the work began that keeps all processors busy
  Stopwatch of_work_;
  std::mutex telling_;
  Stopwatch told_;
  std::atomic<uint64_t> rendered_ = 0;
};

}  // namespace covary
