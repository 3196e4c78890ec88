// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace covary {

/// A folder that this process alone works in, as long as the object lives: its file `.lock` is locked (flock) and holds
/// the process's id. A lock of a process that has died is none; the file is removed at the end.
class FolderLock {
 public:
  /// Makes the folder where it is missing. Throws Error(kIo) where `folder` is something else than a folder, cannot be
  /// written to, or another process holds it, which the message names by its id. File systems without locks are taken
  /// as they are.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::string path_;
  int file_ = -1;
};

}  // namespace covary
