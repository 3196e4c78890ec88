// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "scene/parameters.h"

namespace covary {

/// Finds the files a scene names and remembers them, for the scene's content hash. Thread-safe once all folders are
/// added.
class FileResolver {
 public:
  /// Folders are searched last added first, then the folder of the XML file that names the file.
  void add_folder(const std::string& folder);

  /// Path of the existing regular file `name`; records an error at `where` and returns "" when there is none.
  std::string resolve(const std::string& name, const SourceLocation& where, Diagnostics& diagnostics);

  /// Every file found so far by resolve(), by its path, with the name the scene used.
  std::map<std::string, std::string> files() const;

  /// Hash of names and contents of these files; one that cannot be read counts as such.
  std::string content_hash(const std::string& scene_hash) const;

 private:
  std::vector<std::string> folders_;
  mutable std::mutex mutex_;
  std::map<std::string, std::string> files_;
};

}  // namespace covary
