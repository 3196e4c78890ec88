// SPDX-License-Identifier: Apache-2.0
// A render with a page that shows it and has buttons. What is shown is made between waves, for at most kShare of the
// time so far, and only while somebody looks; samples and their order in each pixel are those of the render without a
// page, so the image has the same bits unless a button was pressed.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "core/stopwatch.h"
#include "live/live_page.h"
#include "plans/render.h"

namespace covary {

struct LiveTexts {
  std::string title;   ///< of the page
  std::string output;  ///< the image's file; may be empty
  std::string resume;  ///< the command that continues the render; may be empty
};

class LiveRender {
 public:
  /// Of the time so far: what pictures on the way may cost.
  static constexpr double kShare = 0.02;

  /// Serves the page at once. `port` 0: any free one. `stop` is called once the reader wants the render to end; it
  /// sets the flag that RenderCallbacks::stop points to. Throws Error(kIo).
  LiveRender(int port, LiveTexts texts, std::function<void()> stop);

  const LivePage& page() const { return page_; }

  /// render() of plans/render.h, watched; `callbacks` are called as well.
  RenderResult render(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                      const RenderCallbacks& callbacks);

  /// Whether the reader pressed "Stop and write".
  bool stopped_here() const { return whole_image_; }
  /// Says what has become of the render, and waits a moment until the readers have it all.
  void end(const std::string& text);

 private:
  struct Watched {
    const LoadedScene& scene;
    const Plan& plan;
    const RenderRequest& request;
    const RenderCallbacks& inner;
  };
  RenderCallbacks watching();
  void act(const nlohmann::json& asked);
  void first_picture();
  void begun();
  void wave(std::span<const Pass> passes);
  void show_mean(std::span<const Pass> passes);
  void show_denoised(std::span<const Pass> passes);
  void show_estimate(const EstimatorResult& result, const std::optional<PredictedError>& predicted);
  void progress(uint64_t done, uint64_t total);
  void wait_while_paused();
  void add_error(const char* of, double relmse, const std::optional<PredictedBounds>& bounds);
  void show(const char* name, const Image& image, int stride = 1);
  void say_pictures();
  void say_goal();
  nlohmann::json numbers(uint64_t done, uint64_t total) const;
  bool may_spend(double seconds) const { return spent_ + seconds <= kShare * seconds_; }
  double seconds() const;  // of the render, without pauses

  LiveTexts texts_;
  std::function<void()> stop_;
  std::atomic<bool> whole_image_{false}, paused_{false}, counts_samples_{false};
  std::unique_ptr<Watched> of_;  // during render()

  // In the render's thread.
  const std::map<std::string, Image>* aovs_ = nullptr;
  nlohmann::json errors_ = nlohmann::json::array();
  std::map<std::string, std::string> labels_;       // of the pictures
  double spent_ = 0, seconds_ = 0;                  // for pictures, of all
  double mean_cost_ = 0, denoised_pixel_cost_ = 0;  // seconds of the last mean, and per pixel of the last denoising
  uint64_t mean_samples_ = 0;                       // of the mean that is shown

  mutable std::mutex mutex_;  // of all below
  std::condition_variable resumed_;
  Stopwatch watch_;
  double paused_seconds_ = 0, paused_since_ = 0, next_numbers_ = 0;
  double rays_per_sample_ = 0, samples_per_pixel_ = 0;
  uint64_t done_ = 0, total_ = 0, first_done_ = 0, goal_total_ = 0;  // samples; the last: for the target error
  uint32_t spp_ = 0;                                                 // that the render takes at most
  double until_ = 0, relmse_ = 0;                                    // target error, and the last one predicted
  bool raised_ = false;                                              // either of the two
  std::optional<CropWindow> region_;
  LivePage page_;  // last: its server uses the others
};

}  // namespace covary
