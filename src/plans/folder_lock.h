// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace covary {

/// Reserves a folder for this process as long as the object lives: its file `.lock` is locked (flock) and holds the
/// process's id. The lock of a dead process does not count; the file is removed at the end.
class FolderLock {
 public:
  /// Creates the folder if missing. Throws Error(kIo) if `folder` is not a folder, cannot be written to, or another
  /// process holds it, naming that process's id. File systems without locks are used without one.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::string path_;
  int file_ = -1;
};

}  // namespace covary
