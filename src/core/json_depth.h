// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace covary {

/// Maximum nesting depth of JSON files: code that walks them may recurse.
inline constexpr int kMaxJsonDepth = 64;

/// Line of a JSON text, counted from 1, at which arrays and objects first nest deeper than kMaxJsonDepth; 0 if none
/// does. Call before parsing. The text need not be valid JSON.
int line_nested_too_deep(std::string_view text);

}  // namespace covary
