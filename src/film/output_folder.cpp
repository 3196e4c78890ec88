// SPDX-License-Identifier: Apache-2.0
#include "film/output_folder.h"

#include <fmt/format.h>

#include <filesystem>
#include <system_error>

#include "core/error.h"

namespace covary {

void make_output_folder(const std::string& folder) {
  namespace fs = std::filesystem;
  std::error_code error;
  if (folder.empty() || fs::is_directory(folder, error)) return;
  const fs::path path = fs::path(folder).has_filename() ? fs::path(folder) : fs::path(folder).parent_path();
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (!fs::is_directory(parent, error))
    throw Error(ErrorCode::kIo, fmt::format("cannot make the folder '{}': there is no folder '{}', which would hold it",
                                            folder, parent.string()));
  fs::create_directory(path, error);
  if (error) throw Error(ErrorCode::kIo, fmt::format("cannot make the folder '{}': {}", folder, error.message()));
}

}  // namespace covary
