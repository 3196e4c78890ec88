// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace covary {

/// Reserves a folder for this process for the object's lifetime: its file `.lock` is locked (flock) and contains the
/// process id. The lock of a dead process has no effect; the file is removed at the end.
class FolderLock {
 public:
  /// Creates the folder if missing. Throws Error(kIo) if `folder` is not a folder, cannot be written to, or is held by
  /// another process, whose id the message gives. On file systems without locks, does nothing.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  std::string path_;
  int file_ = -1;
};

}  // namespace covary
