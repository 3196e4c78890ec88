// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

namespace covary {

/// Wall-clock time since construction, from a monotonic clock.
class Stopwatch {
 public:
  /// Seconds since construction or the last lap().
  double seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }
  /// Returns seconds() and restarts at zero.
  double lap() {
    const Clock::time_point now = Clock::now();
    const double seconds = std::chrono::duration<double>(now - start_).count();
    start_ = now;
    return seconds;
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace covary
