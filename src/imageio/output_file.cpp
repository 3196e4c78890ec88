// SPDX-License-Identifier: Apache-2.0
#include "imageio/output_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <sys/file.h>
#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/number_text.h"

namespace covary {
namespace fs = std::filesystem;
namespace {

constexpr int kMaxLinks = 40;  // same as Linux

[[noreturn]] void fail_to_write(const std::string& path, const std::string& why) {
  throw Error(ErrorCode::kIo, fmt::format("cannot write {}: {}", path, why));
}

std::string follow_links(const std::string& given) {
  fs::path path = given;
  std::error_code error;
  for (int i = 0; fs::is_symlink(path, error); ++i) {
    const fs::path next = fs::read_symlink(path, error);
    if (error || i == kMaxLinks) fail_to_write(given, "a symbolic link that leads nowhere");
    path = next.is_absolute() ? next : path.parent_path() / next;
  }
  return path.string();
}

/// The descriptor of standard output or error if that is the file described by `status`; -1 otherwise.
int standard_stream(const struct stat& status) {
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    struct stat other {};
    if (fstat(stream, &other) == 0 && other.st_dev == status.st_dev && other.st_ino == status.st_ino) return stream;
  }
  return -1;
}

/// Opens a special file.
int open_special(const std::string& path) {
  struct stat status {};
  const int stream = stat(path.c_str(), &status) == 0 ? standard_stream(status) : -1;
  return stream >= 0 ? fcntl(stream, F_DUPFD_CLOEXEC, 3) : open(path.c_str(), O_WRONLY | O_CLOEXEC);
}

/// Returns errno, or 0 when everything was written.
int write_all(int descriptor, const char* data, size_t size) {
  while (size > 0) {
    const ssize_t n = write(descriptor, data, size);
    if (n < 0 && errno != EINTR) return errno;
    if (n > 0) data += n, size -= static_cast<size_t>(n);
  }
  return 0;
}

}  // namespace

OutputTarget output_target(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) == 0) {
    if (S_ISDIR(status.st_mode)) fail_to_write(path, "it is a folder");
    if (!S_ISREG(status.st_mode) || standard_stream(status) >= 0) return {path, true};
    // A rename would replace it anyway; the superuser may write any file, whatever its mode.
    if ((status.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0 || access(path.c_str(), W_OK) != 0)
      fail_to_write(path, "the file there is write-protected; give another name, or permit writing it");
  } else if (errno == ENAMETOOLONG) {
    fail_to_write(path, std::strerror(errno));
  }
  OutputTarget target{follow_links(path)};
  const fs::path name = fs::path(target.path).filename(), folder = fs::path(target.path).parent_path();
  if (name.empty()) throw Error(ErrorCode::kIo, fmt::format("cannot write '{}': it names no file", path));
  std::error_code ignored;
  if (!folder.empty() && !fs::is_directory(folder, ignored)) fail_to_write(path, "no such folder " + folder.string());
  if (access(folder.empty() ? "." : folder.c_str(), W_OK | X_OK) != 0) fail_to_write(path, std::strerror(errno));
  return target;
}

void try_output(const OutputTarget& target) {
  if (target.is_special) return;
  UnfinishedFile trial;
  const int descriptor = trial.create(target.path);
  if (descriptor < 0) fail_to_write(target.path, std::strerror(errno));
  close(descriptor);
}

OutputFile::OutputFile(const std::string& path) : path_(path), target_(output_target(path)) {
  int descriptor = -1;
  if (target_.is_special) {
    descriptor = memfd_create("covary", MFD_CLOEXEC);
  } else {
    descriptor = temporary_.create(target_.path);
  }
  if (descriptor < 0) fail_to_write(path, std::strerror(errno));
  file_ = fdopen(descriptor, "w+b");
  if (file_) return;
  const int error = errno;
  close(descriptor);
  fail_to_write(path, std::strerror(error));
}

OutputFile::~OutputFile() {
  if (file_) std::fclose(file_);
}

void OutputFile::fail(const char* what) {
  if (!failure_) failure_ = errno ? errno : EIO;
  throw Error(ErrorCode::kIo, fmt::format("cannot {} {}: {}", what, path_, std::strerror(failure_)));
}

void OutputFile::write(const void* data, size_t size) {
  errno = 0;
  if (std::fwrite(data, 1, size, file_) != size) fail("write");
}

uint64_t OutputFile::position() {
  errno = 0;
  const off_t position = ftello(file_);
  if (position < 0) fail("write");
  return static_cast<uint64_t>(position);
}

void OutputFile::seek(uint64_t position) {
  errno = 0;
  if (fseeko(file_, static_cast<off_t>(position), SEEK_SET) != 0) fail("write");
}

void OutputFile::close_file() {
  if (std::fclose(std::exchange(file_, nullptr)) != 0) fail("write");
}

void OutputFile::send() {
  std::fflush(stdout);
  const int descriptor = open_special(path_);
  if (descriptor < 0) fail("write");
  std::array<char, 65536> buffer{};
  size_t n = 0;
  std::rewind(file_);
  while (!failure_ && (n = std::fread(buffer.data(), 1, buffer.size(), file_)) > 0)
    failure_ = write_all(descriptor, buffer.data(), n);
  if (close(descriptor) != 0 && !failure_) failure_ = errno;
  if (failure_) fail("write");
  close_file();
}

void OutputFile::commit() {
  errno = failure_;
  if (failure_ || std::fflush(file_) != 0) fail("write");
  if (target_.is_special) return send();
  if (fsync(fileno(file_)) != 0) fail("write");
  close_file();  // some network file systems report a failed write only here
  if (std::rename(temporary_.path().c_str(), target_.path.c_str()) != 0) fail("put in place");
  temporary_.release();
  // Makes the rename itself durable; a file system that does not support this is no reason to fail.
  const std::string folder = fs::path(target_.path).parent_path().string();
  const int descriptor = open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor >= 0) {
    fsync(descriptor);
    close(descriptor);
  }
}

void write_text_file(const std::string& path, const std::string& text) {
  OutputFile file(path);
  file.write(text.data(), text.size());
  file.commit();
}

namespace {

namespace fs = std::filesystem;

constexpr size_t kMaxOpen = 64;  // the handler ignores further files; the next create() for their target removes them
constexpr const char* kEnding = ".part";

/// A path without allocation, for the signal handler.
struct Slot {
  enum State : int { kFree, kTaken, kKnown };
  std::atomic<int> state{kFree};
  std::array<char, PATH_MAX> path{};
};
std::array<Slot, kMaxOpen> g_slots;
static_assert(std::atomic<int>::is_always_lock_free);

int remember(const std::string& path) {
  if (path.size() >= PATH_MAX) return -1;
  for (size_t i = 0; i < kMaxOpen; ++i) {
    int free = Slot::kFree;
    if (!g_slots[i].state.compare_exchange_strong(free, Slot::kTaken)) continue;
    std::memcpy(g_slots[i].path.data(), path.c_str(), path.size() + 1);
    g_slots[i].state = Slot::kKnown;
    return static_cast<int>(i);
  }
  return -1;
}

struct PartName {
  std::string target;
  pid_t process;
};

/// ".NAME.PID-N.part", the names that UnfinishedFile creates.
std::optional<PartName> parse_part_name(const std::string& name) {
  if (!name.starts_with('.') || !name.ends_with(kEnding)) return {};
  const std::string body = name.substr(1, name.size() - 1 - std::strlen(kEnding));
  const size_t dot = body.rfind('.'), dash = body.rfind('-');
  if (dot == std::string::npos || dash == std::string::npos || dot == 0 || dash < dot) return {};
  const auto process = parse_number<pid_t>(body.substr(dot + 1, dash - dot - 1));
  const auto count = parse_number<uint64_t>(body.substr(dash + 1));
  if (!process || !count || *process < 1) return {};
  return PartName{body.substr(0, dot), *process};
}

/// Whether the file's creator is dead: no process has its id, and no process on another machine that may share the file
/// system holds its lock.
bool is_left_over(const fs::path& path, pid_t process) {
  if (kill(process, 0) == 0 || errno != ESRCH) return false;
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return false;
  const bool unlocked = flock(file, LOCK_EX | LOCK_NB) == 0;
  close(file);
  return unlocked;
}

/// Removes leftover files for `target` in a folder, which is scanned only once because it may be large.
void remove_left_over(const fs::path& folder, const std::string& target) {
  static std::mutex mutex;
  static std::map<fs::path, std::multimap<std::string, fs::path>> known;
  const std::lock_guard lock(mutex);
  const auto [found, is_new] = known.try_emplace(folder);
  if (is_new) {
    std::error_code error;
    for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
         entry.increment(error))
      if (const auto part = parse_part_name(entry->path().filename().string());
          part && is_left_over(entry->path(), part->process))
        found->second.emplace(part->target, entry->path());
  }
  const auto [begin, end] = found->second.equal_range(target);
  for (auto part = begin; part != end; ++part) unlink(part->second.c_str());
  found->second.erase(begin, end);
}

}  // namespace

void remove_unfinished_files() noexcept {
  for (const Slot& slot : g_slots)
    if (slot.state == Slot::kKnown) unlink(slot.path.data());
}

int UnfinishedFile::create(const std::string& target) {
  // The name is unique among processes and threads; a long file name is truncated so that the temporary one is valid.
  static std::atomic<unsigned> counter{0};
  const fs::path folder = fs::path(target).parent_path();
  const std::string name = fs::path(target).filename().string().substr(0, 200);
  remove_left_over(folder, name);
  path_ = (folder / fmt::format(".{}.{}-{}{}", name, getpid(), counter++, kEnding)).string();
  slot_ = remember(path_);
  const int file = open(path_.c_str(), O_CREAT | O_EXCL | O_RDWR | O_CLOEXEC, 0666);
  const int error = errno;
  if (file < 0)
    release();
  else
    flock(file, LOCK_SH);
  errno = error;
  return file;
}

void UnfinishedFile::release() {
  if (slot_ >= 0) g_slots[static_cast<size_t>(slot_)].state = Slot::kFree;
  slot_ = -1;
  path_.clear();
}

UnfinishedFile::~UnfinishedFile() {
  if (!path_.empty()) unlink(path_.c_str());
  release();
}

}  // namespace covary
