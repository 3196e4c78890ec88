// SPDX-License-Identifier: Apache-2.0
// Files that appear under their name only when complete: written to a temporary name in the same folder, flushed to the
// device, then renamed.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <string>

namespace covary {

class OutputFile {
 public:
  /// Creates the temporary file. Throws Error(kIo) when the folder is missing or not writable, or `path` names
  /// something that is not a regular file. A symbolic link is followed: the file it points to is replaced.
  explicit OutputFile(const std::string& path);
  /// Removes the temporary file unless commit() succeeded.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  void write(const void* data, size_t size);
  uint64_t position();
  void seek(uint64_t position);
  /// Flushes to the device and renames. Throws Error(kIo) when any write failed, also an earlier one.
  void commit();

 private:
  [[noreturn]] void fail(const char* what);
  std::string path_, target_, temporary_;
  std::FILE* file_ = nullptr;
  int failure_ = 0;  // errno of the first failed write
};

/// Writes `text` as the whole content of the file `path`.
void write_text_file(const std::string& path, const std::string& text);

}  // namespace covary
