// SPDX-License-Identifier: Apache-2.0
// -D name=value on the command line: values for the scene's <default> elements.
#pragma once

#include <CLI/CLI.hpp>
#include <map>
#include <string>
#include <vector>

namespace covary {

void add_define_option(CLI::App& command, std::vector<std::string>& defines);

/// Throws Error(kUsage) for a text that is not name=value.
std::map<std::string, std::string> parse_defines(const std::vector<std::string>& defines);

}  // namespace covary
