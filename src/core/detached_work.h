// SPDX-License-Identifier: Apache-2.0
// Calls into libraries that cannot be ended soon enough: they run in a thread of their own, which is left behind when
// the work around them is stopped.
#pragma once

#include <functional>

namespace covary {

/// Runs `job` in a thread of its own and waits for it; throws what it throws. Where the work around it is to end
/// (run_stoppable()) before it has, calls `cancel` in this thread, leaves `job` behind and throws Stopped. Both must
/// own, or share, all that they touch: `job` may go on after this function has returned.
/// One job at a time: waits first for those that were left behind, stoppable likewise.
void run_detached(std::function<void()> job, const std::function<void()>& cancel);

/// Whether a job that was left behind still runs. A process that ends by exit() or by returning from main() waits for
/// it; one that should not wait calls _exit().
bool has_detached_work();

}  // namespace covary
