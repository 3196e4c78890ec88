// SPDX-License-Identifier: Apache-2.0
#include "imageio/output_folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "core/error.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// "a/b" of "a/b/".
fs::path without_slash(const fs::path& folder) { return folder.has_filename() ? folder : folder.parent_path(); }

fs::path folder_around(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

}  // namespace

bool is_missing_folder(const std::string& folder) {
  std::error_code ignored;
  return !folder.empty() && !fs::exists(folder, ignored) &&
         fs::is_directory(folder_around(without_slash(folder)), ignored);
}

void make_output_folder(const std::string& folder) {
  std::error_code error;
  if (folder.empty() || fs::is_directory(folder, error)) return;
  const fs::path path = without_slash(folder), parent = folder_around(path);
  if (!fs::is_directory(parent, error))
    throw Error(ErrorCode::kIo, fmt::format("cannot make the folder '{}': there is no folder '{}', which would hold it",
                                            folder, parent.string()));
  fs::create_directory(path, error);
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot make the folder '{}': {}", folder, error.message()));
}

}  // namespace covary
