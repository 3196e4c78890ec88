// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <map>
#include <mutex>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Finds the files referenced by a scene and records them for the scene's content hash. Thread-safe once all folders
/// have been added.
class FileResolver {
 public:
  /// Folders are searched in reverse order of addition, then the folder of the file that references the file, then the
  /// working directory.
  void add_folder(const std::string& folder);

  /// Path of the existing regular file `name`; records an error at `where` and returns "" if there is none. Backslashes
  /// may separate folders, and letters may differ in case, with a warning.
  std::string resolve(const std::string& name, const SourceLocation& where, Diagnostics& diagnostics);

  /// Every file that resolve() has found, by path, with the name used in the scene.
  std::map<std::string, std::string> files() const;

  /// Hash of names and contents of these files; unreadable files are hashed as such.
  std::string content_hash(const std::string& scene_hash) const;

 private:
  std::string find(const std::string& name, const SourceLocation& where, Diagnostics& diagnostics) const;

  std::vector<std::string> folders_;
  mutable std::mutex mutex_;
  std::map<std::string, std::string> files_;
};

/// The bytes of a file, memory-mapped for reading; those of a file named *.gz are uncompressed.
class FileView {
 public:
  /// Throws Error(kIo) if the file cannot be opened or is not a regular file; Error(kInput) for a pointer of Git LFS,
  /// or if the file is compressed and damaged, or too large.
  explicit FileView(const std::string& path);
  ~FileView();
  FileView(const FileView&) = delete;
  FileView& operator=(const FileView&) = delete;

  std::span<const std::byte> bytes() const { return std::as_bytes(std::span(text())); }
  std::string_view text() const {
    return is_compressed_ ? std::string_view(uncompressed_) : std::string_view{static_cast<const char*>(data_), size_};
  }

 private:
  void* data_ = nullptr;
  size_t size_ = 0;
  bool is_compressed_ = false;
  std::string uncompressed_;
};

}  // namespace covary
