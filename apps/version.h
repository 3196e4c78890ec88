// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace covary {

/// Version and, if the source tree was a git repository, the commit: "0.1.0 (1c24a5c9d2f3)"; "-dirty" follows the
/// commit if files differed from it.
std::string version_text();

}  // namespace covary
