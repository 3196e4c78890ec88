// SPDX-License-Identifier: Apache-2.0
// Files that appear under their name only when complete: written under a temporary name in the same folder, flushed to
// disk, then renamed. Devices, pipes and standard output get all bytes at once at the end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace covary {

// Temporary output files: a registry of those of this process, so that a fatal signal leaves none behind, and removal
// of those left by killed processes.

/// Removes every temporary file of this process; for signal handlers, before they end the program.
void remove_unfinished_files() noexcept;

/// Such a file; remove_unfinished_files() knows it from before its creation until it is renamed or removed.
class UnfinishedFile {
 public:
  UnfinishedFile() = default;
  ~UnfinishedFile();
  UnfinishedFile(const UnfinishedFile&) = delete;
  UnfinishedFile& operator=(const UnfinishedFile&) = delete;

  /// Creates the temporary file for `target` in the same folder, and removes those for the same target whose process is
  /// dead. Returns a descriptor, or -1 with errno set.
  int create(const std::string& target);
  const std::string& path() const { return path_; }
  /// Call after the file was renamed.
  void release();

 private:
  std::string path_;
  int slot_ = -1;
};

/// Where an output goes.
struct OutputTarget {
  std::string path;         ///< symbolic links resolved, even if the final file does not exist yet
  bool is_special = false;  ///< a device, a pipe, a socket, or the file that is this program's standard output
};

/// Throws Error(kIo) when the folder is missing or not writable, or `path` is empty or names a folder or a
/// write-protected file.
OutputTarget output_target(const std::string& path);

/// Creates and removes the temporary file, so that a long render detects at the start what permissions do not reveal:
/// limits, quotas, unusual file systems. Throws Error(kIo).
void try_output(const OutputTarget& target);

class OutputFile {
 public:
  /// Creates the temporary file; output to special files is buffered until commit(). Throws like output_target().
  explicit OutputFile(const std::string& path);
  /// Removes the temporary file unless commit() succeeded. A signal that ends the program removes it too; after any
  /// other death, the next OutputFile for the same path does.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, size_t size);
  uint64_t position();
  void seek(uint64_t position);
  /// Flushes to disk and renames, or sends everything to the special file. Throws Error(kIo) if this or any earlier
  /// write failed.
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
