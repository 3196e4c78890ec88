// SPDX-License-Identifier: Apache-2.0
// Files that appear under their name only when complete: written to a temporary name in the same folder, flushed to the
// device, then renamed. Devices, pipes and standard output get all bytes at once at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace covary {

// Temporary files of outputs while they are written: which there are in this process, so that a signal that ends it
// leaves none, and which others have left that were killed.

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

/// Where an output goes.
struct OutputTarget {
  std::string path;         ///< symbolic links followed, also to a file that is not there yet
  bool is_special = false;  ///< a device, a pipe, a socket, or the file that is this program's standard output
};

/// Throws Error(kIo) when the folder is missing or not writable, or `path` names a folder, a file that is
/// write-protected, or nothing at all.
OutputTarget output_target(const std::string& path);

/// Makes the temporary file and removes it, so that a long render finds out at its beginning what permissions do not
/// tell: limits, quotas, odd file systems. Throws Error(kIo).
void try_output(const OutputTarget& target);

class OutputFile {
 public:
  /// Creates the temporary file; special files are kept in memory until commit(). Throws like output_target().
  explicit OutputFile(const std::string& path);
  /// Removes the temporary file unless commit() succeeded. So does a signal that ends the program, and after a death
  /// of another kind the next OutputFile of the same path.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, size_t size);
  uint64_t position();
  void seek(uint64_t position);
  /// Flushes to the device and renames, or sends everything to the special file. Throws Error(kIo) when any write
  /// failed, also an earlier one.
  void commit();

 private:
  [[noreturn]] void fail(const char* what);
  void close_file();
  void send();
  std::string path_;
  OutputTarget target_;
  UnfinishedFile temporary_;
  std::FILE* file_ = nullptr;
  int failure_ = 0;  // errno of the first failed write
};

/// Writes `text` as the whole content of the file `path`.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace covary
