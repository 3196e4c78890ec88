// SPDX-License-Identifier: Apache-2.0
// Git LFS (large file storage) keeps large files outside of a repository. Where it is not installed, or only the text
// of a repository was downloaded, a small text file, the pointer, stands in the place of each.
#pragma once

#include <string>

namespace covary {

/// If the file is such a pointer, what that means, as one sentence that names the file; otherwise "", also if the file
/// cannot be read.
std::string git_lfs_problem(const std::string& path);

}  // namespace covary
