// SPDX-License-Identifier: Apache-2.0
// The phases of a render on its progress line.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>

#include "plans/render.h"
#include "progress.h"
#include "render_options.h"

namespace covary {

/// What making the image of its samples is called: "denoising", "combining" or "measuring the error".
std::string estimate_name(const RenderOptions& options);

/// Shows a render's callbacks, with the time left over all phases: as far as later phases have not begun, from what
/// they usually take.
class RenderProgress {
 public:
  RenderProgress(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                 ProgressLine& line);

  void begin(RenderStage stage);
  /// Thread-safe.
  void update(uint64_t done, uint64_t total);
  void predicted(const PredictedError& error) { line_.toward(error); }

 private:
  const RenderOptions& options_;
  ProgressLine& line_;
  double n_pixels_, n_samples_;  ///< samples: of the whole render, as far as known
  double estimate_seconds_;      ///< expected
  std::atomic<RenderStage> stage_ = RenderStage::kTrial;
  Stopwatch of_stage_;
  std::atomic<uint64_t> rendered_ = 0;
};

}  // namespace covary
