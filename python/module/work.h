// SPDX-License-Identifier: Apache-2.0
// Long work for a Python caller: without the GIL, ended by Ctrl-C, with progress.
#pragma once

#include <nanobind/nanobind.h>

#include <atomic>
#include <cstdint>
#include <functional>

namespace covary::python {

namespace nb = nanobind;

/// What the work and its caller tell each other, from any thread.
struct WorkState {
  std::atomic<bool> stop{false};  ///< the caller wants it to end
  std::atomic<uint64_t> done{0}, total{0};
};

/// Runs `work` in a thread of its own while this one waits without the GIL, looks for signals and calls `progress`
/// (a function of done and total, or None), 20 times a second. Rethrows what the work threw; once a signal's handler or
/// `progress` has raised, this is raised instead, when the work has ended. Throws Error(kUsage) in a process that was
/// forked after the first call, because the threads of the library are not in it.
void run_work(const std::function<void(WorkState&)>& work, nb::handle progress);

/// Runs `body`, whose parallel loops end early when `state.stop` is set: what it has made is then to be thrown away.
/// Returns whether it came to its end.
bool run_stoppable(WorkState& state, const std::function<void()>& body);

}  // namespace covary::python
