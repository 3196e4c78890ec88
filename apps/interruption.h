// SPDX-License-Identifier: Apache-2.0
// The only place that handles Ctrl-C (SIGINT), termination requests (SIGTERM) and the closing of the terminal (SIGHUP).
#pragma once

#include <atomic>
#include <string>

namespace covary {

/// Call once, in main(): from then on, each of the signals ends the program at once, with exit code 128 + its number
/// and no partially written file. Signals that the parent process had ignored (nohup) stay ignored.
void catch_signals();

/// While this object lives, the first signal only sets a flag, for work that has something to save; the second ends the
/// program at once. At most one object may exist at a time.
class StopFlag {
 public:
  StopFlag();
  ~StopFlag();
  StopFlag(const StopFlag&) = delete;
  StopFlag& operator=(const StopFlag&) = delete;
  /// The token for the library.
  const std::atomic<bool>* token() const;
  bool is_set() const;
  /// Exit code of an interrupted program: 130 for Ctrl-C.
  int exit_code() const;
};

/// As the first signal does: sets the flag of the StopFlag that lives, if any.
void request_stop();

}  // namespace covary
