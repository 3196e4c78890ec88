// SPDX-License-Identifier: Apache-2.0
// Calls into libraries that cannot be interrupted promptly: each runs in its own thread, which is abandoned when the
// surrounding work is stopped.
#pragma once

#include <functional>

namespace covary {

/// Runs `job` in a thread of its own and waits for it; rethrows what it throws. If the surrounding work is stopped
/// first (run_stoppable()), calls `cancel` in this thread, abandons `job` and throws Stopped. Both must own, or share
/// ownership of, everything they touch: `job` may outlive this call.
/// One job at a time: first waits for abandoned ones, and can be stopped while doing so.
void run_detached(std::function<void()> job, const std::function<void()>& cancel);

/// Whether an abandoned job is still running. A process that ends by exit() or by returning from main() waits for it;
/// one that should not wait calls _exit().
bool has_detached_work();

}  // namespace covary
