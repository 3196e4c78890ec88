// SPDX-License-Identifier: Apache-2.0
// Work that can be ended before its end: by Ctrl-C, by a caller who has changed their mind, by a time limit.
#pragma once

#include <atomic>
#include <exception>
#include <functional>

namespace covary {

/// Leaves work that run_stoppable() has ended; nobody but that function catches it.
class Stopped : public std::exception {
 public:
  const char* what() const noexcept override { return "stopped"; }
};

/// Runs `body` in this thread and asks `stop` 50 times a second in another one. Once it says yes, the loops of
/// parallel_for() inside begin no more iterations and throw Stopped: no code sees their halves. Returns whether `body`
/// came to its end before; what it has made otherwise is to be thrown away. An exception of `body` is thrown on, except
/// after a stop.
bool run_stoppable(const std::function<bool()>& stop, const std::function<void()>& body);

/// The same with a flag; null: nothing stops it.
bool run_stoppable(const std::atomic<bool>* stop, const std::function<void()>& body);

/// Throws Stopped inside of work that is to end: between long steps that are no parallel loops.
void throw_if_stopped();

}  // namespace covary
