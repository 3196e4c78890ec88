// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/resource.h>

#include <algorithm>

namespace covary {

/// Processor time of a process, of all its threads, in user and kernel mode; RUSAGE_SELF or that of a child.
inline double processor_seconds(const rusage& usage) {
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

/// Of this process so far. Unlike the clock, it does not run while other programs have the processors.
inline double processor_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return processor_seconds(usage);
}

/// How long work takes that needs `needed` seconds of processor time on `threads` processors: as long as alone,
/// times how much longer such work took before, which got `processor` seconds within `clock` seconds, because other
/// programs have the processors, too. A tenth of a second of the clock or less tells nothing.
inline double clock_seconds(double needed, double threads, double processor, double clock) {
  constexpr double kTells = 0.1, kMinShare = 0.01;
  const double share = clock > kTells ? std::clamp(processor / (clock * threads), kMinShare, 1.0) : 1;
  return needed / (threads * share);
}

}  // namespace covary
