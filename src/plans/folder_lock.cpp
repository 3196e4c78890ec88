// SPDX-License-Identifier: Apache-2.0
#include "plans/folder_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <filesystem>

#include "core/error.h"
#include "imageio/output_folder.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// Whether the path still names the open file, which its previous owner may have removed.
bool is_current(int file, const std::string& path) {
  struct stat opened {
  }, named{};
  return fstat(file, &opened) == 0 && stat(path.c_str(), &named) == 0 && opened.st_dev == named.st_dev &&
         opened.st_ino == named.st_ino;
}

/// "process 1234", according to the file.
std::string holder(int file) {
  std::array<char, 32> text{};
  const ssize_t size = pread(file, text.data(), text.size() - 1, 0);
  const std::string id(text.data(), static_cast<size_t>(std::max<ssize_t>(size, 0)));
  return id.empty() ? "another process" : "process " + id.substr(0, id.find('\n'));
}

}  // namespace

FolderLock::FolderLock(const std::string& folder) : path_((fs::path(folder) / ".lock").string()) {
  std::error_code error;
  if (fs::exists(folder, error) && !fs::is_directory(folder, error))
    throw Error(ErrorCode::kIo, fmt::format("'{}' is not a folder; films of passes are kept in one", folder));
  make_output_folder(folder);
  for (;;) {
    file_ = open(path_.c_str(), O_CREAT | O_RDWR | O_CLOEXEC, 0666);
    if (file_ < 0)
      throw Error(ErrorCode::kIo, fmt::format("cannot write to the folder '{}': {}", folder, std::strerror(errno)));
    if (flock(file_, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
      const std::string who = holder(file_);
      close(file_);
      throw Error(ErrorCode::kIo,
                  fmt::format("{} renders into the folder '{}'; wait for it, or use another folder", who, folder));
    }
    if (is_current(file_, path_)) break;
    close(file_);
  }
  const std::string id = fmt::format("{}\n", getpid());
  if (ftruncate(file_, 0) != 0 || pwrite(file_, id.data(), id.size(), 0) < 0) {
    const std::string reason = std::strerror(errno);
    close(file_);
    throw Error(ErrorCode::kIo, fmt::format("cannot write to the folder '{}': {}", folder, reason));
  }
}

FolderLock::~FolderLock() {
  unlink(path_.c_str());
  close(file_);
}

}  // namespace covary
