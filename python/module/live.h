// SPDX-License-Identifier: Apache-2.0
// What a caller sees of a render in Python before it has ended: a page in the browser, and steps.
#pragma once

#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "live/live_render.h"
#include "python/module/bindings.h"
#include "python/module/work.h"

namespace covary::python {

/// A page for one render.
struct Page {
  Page(int port, const std::string& title, const std::string& output);
  std::atomic<std::atomic<bool>*> stop{nullptr};  ///< of the render, while it runs
  LiveRender live;
};

/// Images on the way. Each is made between waves, once the one before was taken and the time so far allows it.
class Steps {
 public:
  /// `take` is called with (image, std_error or None, samples per pixel, relmse or None, bounds or None); None: never.
  explicit Steps(nb::object take) : take_(std::move(take)) {}
  void watch(RenderCallbacks& callbacks);
  /// Calls `take` if there is a new step; with the GIL.
  void deliver();

 private:
  struct Step {
    Image image, std_error;
    double samples = 0;
    std::optional<double> relmse;
    std::optional<PredictedBounds> bounds;
  };
  void wave(std::span<const Pass> passes);
  void put(Step step);

  nb::object take_;
  const Stopwatch watch_;
  double spent_ = 0, cost_ = 0, samples_ = 0;
  std::mutex mutex_;  // of:
  std::optional<Step> next_;
};

}  // namespace covary::python
