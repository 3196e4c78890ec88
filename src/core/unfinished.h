// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/error.h"

namespace covary {

/// Exit code of work interrupted by Ctrl-C, as in shells: 128 + signal number.
inline constexpr int kInterrupted = 130;

/// Work that ended early; what was finished is kept.
class Unfinished : public Error {
 public:
  /// `exit_code`: exit code of the program.
  Unfinished(int exit_code, const std::string& message) : Error(ErrorCode::kIo, message), exit_code_(exit_code) {}
  int exit_code() const { return exit_code_; }

 private:
  int exit_code_;
};

}  // namespace covary
