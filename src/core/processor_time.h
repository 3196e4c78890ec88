// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/resource.h>

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

}  // namespace covary
