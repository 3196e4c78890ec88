// SPDX-License-Identifier: Apache-2.0
#include "core/git_lfs.h"

#include <array>
#include <fstream>
#include <string_view>

namespace covary {

std::string git_lfs_problem(const std::string& path) {
  // The first line of every pointer: https://github.com/git-lfs/git-lfs/blob/main/docs/spec.md
  constexpr std::string_view kFirst = "version https://git-lfs.github.com/spec/";
  std::array<char, kFirst.size()> start{};
  std::ifstream file(path, std::ios::binary);
  if (!file.read(start.data(), start.size()) || std::string_view(start.data(), start.size()) != kFirst) return "";
  return "'" + path +
         "' is a pointer of Git LFS, not the file itself; fetch the file with 'git lfs pull' in its repository, or "
         "download it";
}

}  // namespace covary
