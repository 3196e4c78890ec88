// SPDX-License-Identifier: Apache-2.0
#include "core/stop.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "core/parallel.h"

namespace covary {
namespace {

TEST(RunStoppable, SaysThatTheWorkCameToItsEnd) {
  std::atomic<bool> stop{false};
  int n = 0;
  EXPECT_TRUE(run_stoppable(&stop, [&] { n = 1; }));
  EXPECT_EQ(n, 1);
  stop = true;
  EXPECT_FALSE(run_stoppable(&stop, [&] { n = 2; }));
  EXPECT_EQ(n, 1) << "it did not begin";
  EXPECT_TRUE(run_stoppable(nullptr, [&] { n = 3; }));
}

TEST(RunStoppable, ThrowsWhatTheWorkThrows) {
  const std::atomic<bool> stop{false};
  EXPECT_THROW(run_stoppable(&stop, [] { throw std::runtime_error("x"); }), std::runtime_error);
  EXPECT_THROW(run_stoppable(&stop, [] { parallel_for(9, [](int) { throw std::runtime_error("x"); }); }),
               std::runtime_error);
}

// The loops used under ThreadSanitizer know nothing of TBB task groups.
#ifndef COVARY_PLAIN_THREADS
bool stopped() {
  try {
    throw_if_stopped();
  } catch (const Stopped&) {
    return true;
  }
  return false;
}

/// An iteration requests the stop and waits until it takes effect, so that the loop cannot end first.
TEST(RunStoppable, LoopsEndAndNothingAfterThemIsRun) {
  std::atomic<bool> stop{false};
  std::atomic<int> begun{0};
  bool after = false;
  EXPECT_FALSE(run_stoppable(&stop, [&] {
    parallel_for(1 << 20, [&](int) {
      parallel_for(4, [&](int) {
        ++begun;
        stop = true;
        while (!stopped()) std::this_thread::yield();
      });
    });
    after = true;
  }));
  EXPECT_FALSE(after);
  EXPECT_LT(begun, 1 << 20);
}

TEST(RunStoppable, AnErrorAfterTheStopIsNone) {
  std::atomic<bool> stop{false};
  EXPECT_FALSE(run_stoppable(&stop, [&] {
    stop = true;
    while (!stopped()) std::this_thread::yield();
    EXPECT_THROW(throw_if_stopped(), Stopped);
    throw std::runtime_error("what a library says of being stopped");
  }));
}
#endif

TEST(RunStoppable, OutsideOfItNothingStops) { EXPECT_NO_THROW(throw_if_stopped()); }

}  // namespace
}  // namespace covary
