// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <string>

#include "core/stopwatch.h"

namespace covary {

/// A line on stderr that shows how far a render is, its rate and the time left. On a terminal the line is redrawn a few
/// times a second; otherwise a new line appears every ten seconds, so that logs stay short.
class ProgressLine {
 public:
  explicit ProgressLine(std::string label, bool quiet);
  /// `total` == 0: unknown. `seconds_limit` > 0: the time budget that ends the work if `total` is not reached first.
  void update(uint64_t done, uint64_t total, double seconds_limit);
  /// Clears the line (terminal) before other output.
  void finish();

 private:
  std::string label_;
  bool quiet_, terminal_, drawn_ = false;
  Stopwatch watch_;
  double next_;  // when to draw, seconds
  std::mutex mutex_;
};

/// 75 -> "1:15", 4000 -> "1:06:40".
std::string format_duration(double seconds);
/// 1234567 -> "1.23 M".
std::string format_count(double count);

}  // namespace covary
