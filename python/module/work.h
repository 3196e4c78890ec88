// SPDX-License-Identifier: Apache-2.0
// Long work for a Python caller: without the GIL, interruptible by Ctrl-C, with progress.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <cstdint>
#include <functional>

namespace covary::python {

namespace nb = nanobind;

/// Shared by the work and its caller, on any thread.
struct WorkState {
  std::atomic<bool> stop{false};  ///< the caller wants it to end
  std::atomic<uint64_t> done{0}, total{0};
  std::atomic<const char*> phase{nullptr};  ///< named to `progress`, as a third argument, if not null
};

/// Runs `work` on another thread. Meanwhile this thread waits without the GIL, checks for signals and calls `progress`
/// (a function of done and total, and of the phase if there is one, or None), 20 times a second. Rethrows what the work
/// threw. If a signal's handler or `progress` raised, that is raised instead once the work has ended. Throws
/// Error(kUsage) in a process that was forked after the first call, because it lacks the library's threads.
void run_work(const std::function<void(WorkState&)>& work, nb::handle progress);

/// Runs `body`, whose parallel loops end early when `state.stop` is set; its results must then be discarded. Returns
/// whether it ran to its end.
bool run_stoppable(WorkState& state, const std::function<void()>& body);

}  // namespace covary::python
