// SPDX-License-Identifier: Apache-2.0
#include "core/detached_work.h"

#include <gtest/gtest.h>
#include <tbb/task_group.h>

#include <atomic>
#include <chrono>
#include <memory>
#include <stdexcept>
#include <thread>

#include "core/stop.h"

namespace covary {
namespace {

void wait_for(const std::atomic<bool>& flag) {
  while (!flag) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

TEST(RunDetached, WaitsForTheJobAndThrowsWhatItThrows) {
  int n = 0;
  run_detached([&] { n = 1; }, [] { FAIL() << "nothing stops it"; });
  EXPECT_EQ(n, 1);
  EXPECT_THROW(run_detached([] { throw std::runtime_error("x"); }, [] {}), std::runtime_error);
  EXPECT_FALSE(has_detached_work());
}

/// The job ends only after the caller has abandoned it: a caller that waited for it would hang.
TEST(RunDetached, LeavesTheJobBehindWhenStopped) {
  struct Shared {
    std::atomic<bool> begun{false}, may_end{false}, cancelled{false}, ended{false};
  };
  const auto shared = std::make_shared<Shared>();
  const std::function<bool()> stop = [shared] { return shared->begun.load(); };
  bool after = false;
  EXPECT_FALSE(run_stoppable(stop, [&] {
    run_detached(
        [shared] {
          shared->begun = true;
          wait_for(shared->may_end);
          shared->ended = true;
        },
        [shared] { shared->cancelled = true; });
    after = true;
  }));
  EXPECT_FALSE(after);
  EXPECT_TRUE(shared->cancelled);
  EXPECT_FALSE(shared->ended);
  EXPECT_TRUE(has_detached_work());

  // The next job can be stopped while it waits for the first one, and starts only after it.
  std::atomic<bool> second{false}, asked{false};
  EXPECT_FALSE(run_stoppable([&] { return asked.exchange(true); },
                             [&] { run_detached([&] { second = true; }, [] { FAIL() << "it has not begun"; }); }));
  EXPECT_FALSE(second);
  std::thread opener([shared] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    shared->may_end = true;
  });
  run_detached([&] { EXPECT_TRUE(shared->ended); }, [] {});
  opener.join();
  EXPECT_FALSE(has_detached_work());
}

#ifndef COVARY_PLAIN_THREADS
/// Waits until the surrounding work is stopped.
void wait_for_stop() {
  try {
    for (;;) throw_if_stopped();
  } catch (const Stopped&) {
  }
}

/// A task group that was first used inside work does its tasks after the work was stopped.
TEST(RunOutside, KeepsTaskGroupsFromTheStop) {
  std::atomic<bool> stop{false};
  tbb::task_group outside;
  run_stoppable(&stop, [&] {
    run_outside([&] { outside.run_and_wait([] {}); });
    stop = true;
    wait_for_stop();
    int n = 0;
    outside.run_and_wait([&] { n += 1; });
    EXPECT_EQ(n, 1);
    run_outside([&] { EXPECT_NO_THROW(throw_if_stopped()); });
  });
  int n = 0;
  outside.run_and_wait([&] { n = 1; });
  EXPECT_EQ(n, 1);
}

TEST(RunOutside, ThrowsWhatTheBodyThrows) {
  tbb::task_group kept;
  EXPECT_THROW(run_outside([&] {
                 kept.run_and_wait([] {});
                 throw std::runtime_error("x");
               }),
               std::runtime_error);
  int n = 0;
  kept.run_and_wait([&] { n = 1; });
  EXPECT_EQ(n, 1) << "the error of one body is none of the others";
}
#endif

}  // namespace
}  // namespace covary
