// SPDX-License-Identifier: Apache-2.0
// What messages about unknown names end with.
#pragma once

#include <cctype>
#include <string>
#include <vector>

#include "core/error.h"

namespace covary {

/// "; expected a, b", or after a hint, which comes first, "; did you mean 'a'? Expected a, b". `list`: "expected a, b".
inline std::string hint_and_list(const std::string& name, const std::vector<std::string>& known, std::string list) {
  const std::string hint = did_you_mean(name, known);
  if (hint.empty()) return "; " + list;
  list[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(list[0])));
  return hint + " " + list;
}

}  // namespace covary
