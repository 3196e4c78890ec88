// SPDX-License-Identifier: Apache-2.0
#include "interruption.h"

#include <unistd.h>

#include <csignal>
#include <cstring>

#include "core/error.h"
#include "imageio/output_file.h"

namespace covary {
namespace {

// Lock-free atomics may be shared by a signal handler and threads.
std::atomic<bool> g_kept{false}, g_stop{false};
std::atomic<int> g_signal{0};
static_assert(std::atomic<bool>::is_always_lock_free && std::atomic<int>::is_always_lock_free);

/// Only async-signal-safe calls.
extern "C" void on_signal(int signal) {
  if (g_kept && !g_stop) {
    g_signal = signal;
    g_stop = true;
    return;
  }
  remove_unfinished_files();
  constexpr const char* kText = "covary: interrupted\n";
  [[maybe_unused]] const ssize_t nobody_may_read_it = ::write(STDERR_FILENO, kText, std::strlen(kText));
  _exit(128 + signal);
}

}  // namespace

void catch_signals() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP})
    if (std::signal(signal, on_signal) == SIG_IGN) std::signal(signal, SIG_IGN);
}

StopFlag::StopFlag() {
  COVARY_CHECK(!g_kept, "one piece of work at a time handles signals");
  g_stop = false;
  g_kept = true;
}

StopFlag::~StopFlag() { g_kept = false; }

const std::atomic<bool>* StopFlag::token() const { return &g_stop; }

void request_stop() {
  if (g_kept) g_stop = true;
}

bool StopFlag::is_set() const { return g_stop; }

int StopFlag::exit_code() const { return 128 + g_signal; }

}  // namespace covary
