// SPDX-License-Identifier: Apache-2.0
// Texts of files for terminals, which obey control characters.
#pragma once

#include <string>
#include <string_view>

namespace covary {

/// The text with control characters but line feeds as "\x1b" (ASCII, and U+0080 to U+009F of UTF-8).
std::string printable(std::string_view text);

}  // namespace covary
