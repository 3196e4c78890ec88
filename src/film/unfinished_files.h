// SPDX-License-Identifier: Apache-2.0
// Temporary files of outputs while they are written: which there are in this process, so that a signal that ends it
// leaves none, and which others have left that were killed.
#pragma once

#include <string>

namespace covary {

/// Removes every temporary file of this process; for a signal's handler before it ends the program.
void remove_unfinished_files() noexcept;

/// Such a file, known to remove_unfinished_files() from before it is made until it has another name or is gone.
class UnfinishedFile {
 public:
  UnfinishedFile() = default;
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  /// Makes the temporary file for `target` in the same folder, and removes those for the same target whose process is
  /// dead. Returns a descriptor, or -1 with errno.
  int create(const std::string& target);
  const std::string& path() const { return path_; }
  /// The file has got its name.
  void release();

 private:
  std::string path_;
  int slot_ = -1;
};

}  // namespace covary
