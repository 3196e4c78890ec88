// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace covary {

/// What is wrong with the first argument that the parsed command does not take, an option if there is one, with those
/// that it may mean; "" if there is none. `name`: of the command, "covary render".
std::string unknown_argument(const CLI::App& command, const std::string& name);

}  // namespace covary
