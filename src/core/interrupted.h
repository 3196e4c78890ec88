// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/error.h"

namespace covary {

/// Work that its user stopped before its end; what is done so far is kept. The program's exit code is 130, which is
/// what shells give to one that SIGINT ended.
class Interrupted : public Error {
 public:
  explicit Interrupted(const std::string& message) : Error(ErrorCode::kIo, message) {}
};

}  // namespace covary
