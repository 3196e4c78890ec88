// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/error.h"

namespace covary {

/// Throws what is wrong with a file: "path: what".
[[noreturn]] inline void fail_input(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::kInput, path + ": " + what);
}

}  // namespace covary
