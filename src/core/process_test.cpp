// SPDX-License-Identifier: Apache-2.0
// Child processes: their output, their exit, and what happens to them when this process is told to stop.
#include "core/process.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <thread>

#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;

ProcessResult shell(const std::string& script, const std::atomic<bool>* stop = nullptr) {
  return run_process({"/bin/sh", "-c", script}, stop);
}

TEST(Process, GivesBackBothStreamsAndTheExitCode) {
  const ProcessResult result = shell("echo out; echo err >&2; exit 3");
  EXPECT_EQ(result.output, "out\n");
  EXPECT_EQ(result.errors, "err\n");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(result.signal, 0);
  EXPECT_FALSE(result.ok());
  EXPECT_GT(result.seconds, 0);
  EXPECT_GT(result.peak_memory_bytes, 0u);
  EXPECT_TRUE(shell("exit 0").ok());
}

TEST(Process, TakesArgumentsAsTheyAre) {
  const std::string odd = "a 'quoted' \"word\"\n$(exit 9) ü *";
  EXPECT_EQ(run_process({"/bin/sh", "-c", "printf %s \"$1\"", "sh", odd}).output, odd);
  EXPECT_EQ(run_process({"/bin/sh", "-c", "printf %s \"$#\"", "sh", "", "two words"}).output, "2");
}

TEST(Process, TellsTheSignalThatEndedIt) {
  const ProcessResult result = shell("echo before >&2; kill -SEGV $$");
  EXPECT_EQ(result.signal, SIGSEGV);
  EXPECT_EQ(result.exit_code, 128 + SIGSEGV);
  EXPECT_TRUE(contains(result.errors, "before\n"));
  EXPECT_FALSE(result.ok());
}

TEST(Process, SaysThatAProgramCannotBeRun) {
  const ProcessResult result = run_process({"/nowhere/program", "argument"});
  EXPECT_EQ(result.exit_code, 127);
  EXPECT_EQ(result.errors, "cannot run /nowhere/program");
}

/// Both pipes are drained while the child runs: filling one must not deadlock. Only the end of standard error is kept.
TEST(Process, TakesMoreThanAPipeHolds) {
  const ProcessResult result = shell("head -c 1000000 /dev/zero; head -c 1000000 /dev/zero >&2; echo last >&2");
  EXPECT_EQ(result.output.size(), 1000000u);
  EXPECT_LE(result.errors.size(), 2 * 65536u + 4096u);
  EXPECT_TRUE(result.errors.ends_with("last\n"));
}

/// The child is not in the terminal's foreground group, to which its signals go.
TEST(Process, IsAGroupOfItsOwn) {
  EXPECT_EQ(shell("test \"$(cut -d' ' -f5 /proc/$$/stat)\" = $$ && echo own").output, "own\n");
}

/// A signal between fork and exec is not lost and does not run the parent's handler in the child.
TEST(Process, IsInterruptedFromTheFirstMomentOn) {
  const std::atomic<bool> stop{true};
  const auto before = std::signal(SIGINT, [](int) {});
  for (int i = 0; i < 50; ++i) EXPECT_EQ(run_process({"/bin/sleep", "60"}, &stop).signal, SIGINT);
  std::signal(SIGINT, before);
}

TEST(TellingLine, IsTheFirstOrTheLastOfATraceback) {
  EXPECT_EQ(telling_line(""), "");
  EXPECT_EQ(telling_line("covary: no such file\nmore"), "covary: no such file");
  EXPECT_EQ(complaint("covary: no such file\nmore"), "no such file");
  EXPECT_EQ(telling_line("Traceback (most recent call last):\n  File \"a.py\", line 1\nKeyError: 'x'\n"),
            "KeyError: 'x'");
  EXPECT_EQ(telling_line("Traceback"), "Traceback");
}

TEST(Process, HasNothingToRead) { EXPECT_EQ(shell("cat; echo end").output, "end\n"); }

TEST(Process, InterruptsTheChildWhenToldToStop) {
  const std::atomic<bool> stop{true};
  const ProcessResult caught = shell("trap 'echo caught; exit 5' INT; while :; do sleep 0.05; done", &stop);
  // The signal may arrive before the trap is set.
  EXPECT_TRUE((caught.exit_code == 5 && caught.output == "caught\n") || caught.signal == SIGINT) << caught.exit_code;
}

/// The child starts with default signal handlers, whatever this process does with them.
TEST(Process, ChildrenCanBeInterruptedThoughTheParentIgnoresIt) {
  const auto before = std::signal(SIGINT, SIG_IGN);
  std::atomic<bool> stop{false};
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    stop = true;
  });
  const ProcessResult result = run_process({"/bin/sleep", "60"}, &stop);
  later.join();
  std::signal(SIGINT, before);
  EXPECT_EQ(result.signal, SIGINT);
  EXPECT_LT(result.seconds, 30);
}

}  // namespace
}  // namespace covary
