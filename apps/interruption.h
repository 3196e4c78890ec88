// SPDX-License-Identifier: Apache-2.0
// Ctrl-C (SIGINT), a request to end (SIGTERM) and the end of the terminal (SIGHUP): the only place that handles them.
#pragma once

#include <atomic>
#include <string>

namespace covary {

/// For main(), once: from here on each of the signals ends the program at once, whatever it does, with the exit code
/// 128 + its number, and no half-written file is left. Whoever started the program may have it ignore some (nohup):
/// these stay ignored.
void catch_signals();

/// As long as it lives, the first signal only sets a flag, for work that has something to keep; the second one ends the
/// program at once. Not more than one at a time.
class StopFlag {
 public:
  StopFlag();
  ~StopFlag();
  StopFlag(const StopFlag&) = delete;
  StopFlag& operator=(const StopFlag&) = delete;
  /// The token for the library.
  const std::atomic<bool>* token() const;
  bool is_set() const;
  /// Of a program that has ended early: 130 for Ctrl-C.
  int exit_code() const;
};

}  // namespace covary
