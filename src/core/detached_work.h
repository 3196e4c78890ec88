// SPDX-License-Identifier: Apache-2.0
// Calls into libraries that a stop of the surrounding work must not reach: those that cannot be interrupted promptly
// run in threads of their own, which are abandoned; those that keep what they make with TBB run outside of the work.
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

/// Runs `body` in this thread, but outside of the surrounding work: for libraries whose objects use TBB and outlive the
/// work. TBB's task groups keep as their parent the context that they are first used in, and that of run_stoppable()
/// ends with its work. `body` is not stopped. Rethrows what it throws.
void run_outside(const std::function<void()>& body);

}  // namespace covary
