// SPDX-License-Identifier: Apache-2.0
// The library's only exception type, and checks for programming errors.
#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace covary {

enum class ErrorCode {
  kUsage,     ///< a wrong option or combination of options; exit code 2
  kInput,     ///< a file whose content is wrong or unsupported
  kIo,        ///< a file that cannot be opened, read or written
  kInternal,  ///< a bug in covary
};

/// Every error the library throws. The library never prints, exits or aborts; programs turn this into a message and
/// exit code.
class Error : public std::runtime_error {
 public:
  Error(ErrorCode code, const std::string& message) : std::runtime_error(message), code_(code) {}
  ErrorCode code() const { return code_; }

 private:
  ErrorCode code_;
};

/// The `candidates` nearest to `name` by edit distance, best first, at most `count`; none farther than half the length
/// of `name`, or 1 if that is more.
std::vector<std::string> nearest_names(const std::string& name, const std::vector<std::string>& candidates,
                                       size_t count = 3);

/// "; did you mean 'a' or 'b'?" from nearest_names, or "" when nothing is near.
std::string did_you_mean(const std::string& name, const std::vector<std::string>& candidates);

}  // namespace covary

/// Checks for programming errors. Always on, so not for inner loops.
#define COVARY_CHECK(condition, message)                                                                 \
  do {                                                                                                   \
    if (!(condition))                                                                                    \
      throw ::covary::Error(::covary::ErrorCode::kInternal, std::string(message) + " (" #condition ")"); \
  } while (false)
