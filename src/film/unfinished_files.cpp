// SPDX-License-Identifier: Apache-2.0
#include "film/unfinished_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>

#include "core/number_text.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

constexpr size_t kMostOpen = 64;  // further ones are not known to the handler, and the next call removes them
constexpr const char* kEnding = ".part";

/// Names without allocation, for the handler.
struct Slot {
  enum State : int { kFree, kTaken, kKnown };
  std::atomic<int> state{kFree};
  std::array<char, PATH_MAX> path{};
};
std::array<Slot, kMostOpen> g_slots;
static_assert(std::atomic<int>::is_always_lock_free);

int remember(const std::string& path) {
  if (path.size() >= PATH_MAX) return -1;
  for (size_t i = 0; i < kMostOpen; ++i) {
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

/// ".NAME.PID-N.part" as UnfinishedFile makes it.
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

/// Whoever made the file is dead: no process has its number, and on other machines, which may share the file system,
/// none holds its lock.
bool is_left_over(const fs::path& path, pid_t process) {
  if (kill(process, 0) == 0 || errno != ESRCH) return false;
  const int file = open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | O_NONBLOCK);
  if (file < 0) return false;
  const bool unlocked = flock(file, LOCK_EX | LOCK_NB) == 0;
  close(file);
  return unlocked;
}

/// The left over files of a folder by their targets' names. A folder is looked at once, because it may be large.
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
  // The name is unique among processes and threads; a long file name is cut so that the temporary one is valid, too.
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
