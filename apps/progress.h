// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <string>
#include <thread>

#include "core/stopwatch.h"
#include "risk/predicted_error.h"

namespace covary {

/// A line on stderr showing a command's progress, rate and remaining time. On a terminal it is redrawn a few times a
/// second, no wider than the terminal; otherwise a new line with a bar is printed every ten seconds, so that logs stay
/// short. All functions are thread-safe.
class ProgressLine {
 public:
  ProgressLine(std::string label, bool quiet);
  /// Like finish().
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Starts a phase, such as "loading", shown with its seconds until update() reports progress.
  void begin(const std::string& phase);
  /// Samples of the phase. `total` == 0: unknown.
  void update(uint64_t done, uint64_t total);
  /// A time limit, from now on, that ends the work unless `total` is reached first.
  void limit(double seconds);
  /// The error so far, shown with its bounds. With a `goal` > 0, the total is at least the estimated number of samples
  /// for it, as errors fall like 1 / samples.
  void toward(const PredictedError& reached, double goal);
  /// Shows this text instead.
  void show(const std::string& text);
  /// Clears the line (terminal) before other output.
  void clear();
  /// Clears it for good.
  void finish();

 private:
  std::string text(int columns) const;
  std::string bar_text(int columns) const;
  void draw();
  void erase();
  void redraw_regularly();

  const std::string label_;
  const bool quiet_, terminal_;
  std::mutex mutex_;  // of all below
  std::string phase_, shown_, note_;
  uint64_t done_ = 0, total_ = 0, least_total_ = 0;
  uint64_t first_ = 0;  // done_ when the phase began
  bool drawn_ = false, finished_ = false;
  Stopwatch of_line_, of_phase_, of_limit_;
  double seconds_limit_ = 0;
  double next_;  // when to draw, seconds of the line
  std::condition_variable end_;
  std::thread redrawing_;  // on a terminal: shows the seconds of phases without progress
};

/// 75 -> "1:15", 4000 -> "1:06:40".
std::string format_duration(double seconds);
/// 1234567 -> "1.23 M".
std::string format_count(double count);

}  // namespace covary
