// SPDX-License-Identifier: Apache-2.0
// Runs a program as a child process, so that its failure or crash does no harm.
#pragma once

#include <atomic>
#include <cstdint>
#include <string>
#include <vector>

namespace covary {

struct ProcessResult {
  int exit_code = 0;  ///< 128 + signal for a program ended by a signal
  int signal = 0;
  double seconds = 0, processor_seconds = 0;
  uint64_t peak_memory_bytes = 0;
  std::string output;  ///< standard output
  std::string errors;  ///< standard error, the last 64 KiB
  bool ok() const { return exit_code == 0; }
};

/// Runs `command` (path of the program, then its arguments) until it ends. When *stop becomes true, the child gets
/// SIGINT once; Ctrl-C in the terminal does not reach it directly. The child is killed if the calling process dies, for
/// whatever reason. Throws Error(kIo) if no process can be started.
/// `environment`: "NAME=value", beside the caller's own.
ProcessResult run_process(const std::vector<std::string>& command, const std::atomic<bool>* stop = nullptr,
                          const std::vector<std::string>& environment = {});

/// The line of a program's messages that says what is wrong: the first or, of a traceback of Python, the last.
std::string telling_line(const std::string& errors);

/// The same without covary's name in front.
std::string complaint(const std::string& errors);

}  // namespace covary
