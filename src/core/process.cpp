// SPDX-License-Identifier: Apache-2.0
#include "core/process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <functional>

#include "core/error.h"
#include "core/processor_time.h"
#include "core/stopwatch.h"

namespace covary {
namespace {

constexpr size_t kErrorsKept = 65536;

struct Pipe {
  int read = -1, write = -1;
  Pipe() {
    std::array<int, 2> ends{};
    if (pipe2(ends.data(), O_CLOEXEC) != 0)
      throw Error(ErrorCode::kIo, fmt::format("cannot make a pipe: {}", std::strerror(errno)));
    read = ends[0], write = ends[1];
  }
  ~Pipe() {
    close(read);
    close_write();
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;
  void close_write() {
    if (write >= 0) close(write);
    write = -1;
  }
};

/// Blocks the signals that end a program while the object lives: those that arrive between fork and exec must neither
/// run the parent's handlers in the child nor be lost.
class HeldSignals {
 public:
  HeldSignals() {
    sigset_t held;
    sigemptyset(&held);
    for (const int signal : kSignals) sigaddset(&held, signal);
    sigprocmask(SIG_BLOCK, &held, &before_);
  }
  ~HeldSignals() { restore(); }
  HeldSignals(const HeldSignals&) = delete;
  HeldSignals& operator=(const HeldSignals&) = delete;
  void restore() const { sigprocmask(SIG_SETMASK, &before_, nullptr); }
  static constexpr std::array kSignals = {SIGINT, SIGTERM, SIGHUP};

 private:
  sigset_t before_{};
};

/// Runs in the child between fork and exec: async-signal-safe calls only. Leaves the terminal's process group: the
/// parent handles Ctrl-C and passes it on once; a second signal would end the child before it has saved its work.
[[noreturn]] void become(char* const* arguments, char* const* environment, int output, int errors, pid_t parent,
                         const HeldSignals& held) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(127);  // the parent died before the line above
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, 0);
  dup2(output, 1);
  dup2(errors, 2);
  for (const int signal : HeldSignals::kSignals) std::signal(signal, SIG_DFL);
  held.restore();
  execve(arguments[0], arguments, environment);
  _exit(127);
}

/// Forks; `run` is executed in the child and does not return.
pid_t start(const std::function<void(const HeldSignals&)>& run) {
  const HeldSignals held;
  const pid_t child = fork();
  if (child < 0) throw Error(ErrorCode::kIo, fmt::format("cannot start a process: {}", std::strerror(errno)));
  if (child == 0) run(held);
  return child;
}

/// Appends available data; false at the end of the stream.
bool read_some(int descriptor, std::string& text) {
  std::array<char, 4096> buffer{};
  const ssize_t n = read(descriptor, buffer.data(), buffer.size());
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  text.append(buffer.data(), static_cast<size_t>(n));
  return n > 0;
}

}  // namespace

ProcessResult run_process(const std::vector<std::string>& command, const std::atomic<bool>* stop,
                          const std::vector<std::string>& environment) {
  std::vector<char*> arguments, variables;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  for (const std::string& own : environment) variables.push_back(const_cast<char*>(own.c_str()));  // the first counts
  for (char** inherited = environ; *inherited; ++inherited) variables.push_back(*inherited);
  variables.push_back(nullptr);
  Pipe output, errors;
  const Stopwatch watch;
  const pid_t parent = getpid(), child = start([&](const HeldSignals&held) {
                                   become(arguments.data(), variables.data(), output.write, errors.write, parent, held);
                                 });
  output.close_write(), errors.close_write();

  ProcessResult result;
  bool asked = false;
  std::array<pollfd, 2> streams{pollfd{output.read, POLLIN, 0}, pollfd{errors.read, POLLIN, 0}};
  while (streams[0].fd >= 0 || streams[1].fd >= 0) {
    if (stop && stop->load() && !asked) kill(child, SIGINT), asked = true;
    if (poll(streams.data(), streams.size(), 100) <= 0) continue;
    for (pollfd& stream : streams)
      if (stream.revents && !read_some(stream.fd, &stream == &streams[0] ? result.output : result.errors))
        stream.fd = -1;
    if (result.errors.size() > 2 * kErrorsKept) result.errors.erase(0, result.errors.size() - kErrorsKept);
  }
  int status = 0;
  rusage usage{};
  while (wait4(child, &status, 0, &usage) < 0 && errno == EINTR) {
  }
  result.seconds = watch.seconds();
  result.signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  result.exit_code = result.signal ? 128 + result.signal : WEXITSTATUS(status);
  result.processor_seconds = processor_seconds(usage);
  result.peak_memory_bytes = static_cast<uint64_t>(usage.ru_maxrss) * 1024;
  if (result.exit_code == 127 && result.errors.empty()) result.errors = "cannot run " + command[0];
  return result;
}

std::string telling_line(const std::string& errors) {
  const size_t last = errors.find_last_not_of('\n');
  if (!errors.starts_with("Traceback") || last == std::string::npos) return errors.substr(0, errors.find('\n'));
  const size_t begin = errors.rfind('\n', last) + 1;
  return errors.substr(begin, last + 1 - begin);
}

std::string complaint(const std::string& errors) {
  const std::string line = telling_line(errors), name = "covary: ";
  return line.starts_with(name) ? line.substr(name.size()) : line;
}

}  // namespace covary
