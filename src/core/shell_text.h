// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace covary {

/// The words joined into a POSIX shell command line: separated by spaces, quoted where necessary.
std::string shell_text(const std::vector<std::string>& words);
/// Splits such a text into words, with quotes removed.
std::vector<std::string> words_of_shell_text(const std::string& text);

}  // namespace covary
