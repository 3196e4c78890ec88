// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/error.h"

namespace covary {

/// Exit code of work that Ctrl-C ended, as shells have it: 128 + the number of the signal.
inline constexpr int kInterrupted = 130;

/// Work that ended before it was as wanted; what there is was kept.
class Unfinished : public Error {
 public:
  /// `exit_code`: what the program ends with.
  Unfinished(int exit_code, const std::string& message) : Error(ErrorCode::kIo, message), exit_code_(exit_code) {}
  int exit_code() const { return exit_code_; }

 private:
  int exit_code_;
};

}  // namespace covary
