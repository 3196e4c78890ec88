// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

namespace covary {

/// The words as a POSIX shell needs them: separated by spaces, with quotes where necessary.
std::string shell_text(const std::vector<std::string>& words);
/// The words of such a text, quotes removed.
std::vector<std::string> words_of_shell_text(const std::string& text);

}  // namespace covary
