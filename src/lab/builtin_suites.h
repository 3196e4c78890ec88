// SPDX-License-Identifier: Apache-2.0
// The suites that come with the program: suites/*.json of the source tree.
#pragma once

#include <map>
#include <string>
#include <string_view>

namespace covary::lab {

/// Text of each suite by name, "iicv-table1".
const std::map<std::string, std::string_view>& builtin_suites();

}  // namespace covary::lab
