// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

namespace covary {

/// Values of JSON files nest this deep at most: everything that walks through them may call itself.
inline constexpr int kMaxJsonDepth = 64;

/// The line of a JSON text, from 1 on, on which arrays and objects begin to nest deeper than kMaxJsonDepth; 0: on none.
/// To be asked before a text is parsed. The text need not be JSON.
int line_nested_too_deep(std::string_view text);

}  // namespace covary
