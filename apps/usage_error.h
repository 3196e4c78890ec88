// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/error.h"

namespace covary {

/// Throws what is wrong with a command line.
[[noreturn]] inline void usage(const std::string& message) { throw Error(ErrorCode::kUsage, message); }

}  // namespace covary
