// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

#include "core/stopwatch.h"
#include "risk/predicted_error.h"

namespace covary {

/// A line on stderr showing a command's phase and the time left over all of its phases. On a terminal it is redrawn a
/// few times a second, no wider than the terminal. Otherwise a new line is printed after ten seconds, and then at
/// growing intervals, about twenty in an hour, so that logs stay short. All functions are thread-safe.
class ProgressLine {
 public:
  ProgressLine(std::string label, bool quiet);
  /// Like finish().
  ~ProgressLine();
  ProgressLine(const ProgressLine&) = delete;
  ProgressLine& operator=(const ProgressLine&) = delete;

  /// Starts a phase, such as "loading", shown with its seconds until update() reports progress. `done`: where update()
  /// counts on from.
  void begin(const std::string& phase, uint64_t done = 0);
  /// The phase that began last.
  std::string phase() const;
  /// Until the next begin(). Of the phase: a function for the seconds left, if update() does not tell; none are shown
  /// if it says 0 or less. After the phase: work that takes as long as so many units of update(), and seconds.
  void expect(std::function<double()> seconds_left);
  void later(double units, double seconds);
  /// All of it follows again so many times, as the frames of a sequence: of `seconds` each, or 0 if unknown.
  void repeats(int times, double seconds);
  /// Samples of the phase. `total` == 0: unknown.
  void update(uint64_t done, uint64_t total);
  /// A time limit, from now on, that ends the work unless `total` is reached first.
  void limit(double seconds);
  /// The relMSE that ends the work; shown.
  void aim(double goal);
  /// The error so far, shown with its bounds. With a goal, the total is at least the estimated number of samples for
  /// it, as errors fall like 1 / samples.
  void toward(const PredictedError& reached);
  /// Shows this text instead, asked for whenever the line is drawn.
  void show(std::function<std::string()> text);
  /// Prints a line that stays, also for a program that runs this one.
  void print(const std::string& line);
  /// Clears the line (terminal) before other output.
  void clear();
  /// Clears it for good.
  void finish();

 private:
  std::string text(int columns) const;
  std::string bar_text(int columns) const;
  /// Over this and all later phases, if the phase needs `seconds` more.
  double all_left(double seconds) const;
  std::string note() const;
  void draw();
  void erase();
  void start_redrawing();
  void redraw_regularly();

  const std::string label_;
  const bool quiet_, terminal_;
  mutable std::mutex mutex_;  // of all below
  std::string phase_, reached_;
  std::function<std::string()> shown_;
  uint64_t done_ = 0, total_ = 0, min_total_ = 0;
  uint64_t first_ = 0;  // done_ when the phase began
  bool drawn_ = false, finished_ = false;
  Stopwatch of_line_, of_phase_, of_limit_;
  double seconds_limit_ = 0, goal_ = 0;
  std::function<double()> expected_;
  double later_units_ = 0, later_seconds_ = 0;
  int repeats_ = 0;
  double repeat_seconds_ = 0;
  double next_;  // when to draw, seconds of the line
  std::condition_variable end_;
  std::thread redrawing_;  // shows the seconds of phases without progress, and texts that change
};

/// 75 -> "1:15", 4000 -> "1:06:40".
std::string format_duration(double seconds);

/// "1 sample per pixel", "2.5 samples per pixel".
std::string samples_per_pixel_text(double samples);
/// 1234567 -> "1.23 M".
std::string format_count(double count);

}  // namespace covary
