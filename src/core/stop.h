// SPDX-License-Identifier: Apache-2.0
// Work that can be stopped early: by Ctrl-C, by a caller, by a time limit.
#pragma once

#include <atomic>
#include <exception>
#include <functional>

namespace covary {

/// Unwinds work that run_stoppable() has stopped; only that function catches it.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};

/// Runs `body` in this thread while another thread polls `stop` 50 times a second. Once it returns true, parallel_for()
/// loops inside start no further iterations and throw Stopped, so that no code sees partial results. Returns whether
/// `body` ran to completion; if not, its results must be discarded. Rethrows an exception of `body` unless stopped.
bool run_stoppable(const std::function<bool()>& stop, const std::function<void()>& body);

/// Same with a flag; null: never stops.
bool run_stoppable(const std::atomic<bool>* stop, const std::function<void()>& body);

/// Throws Stopped inside work that has been stopped: for use between long serial steps.
void throw_if_stopped();

}  // namespace covary
