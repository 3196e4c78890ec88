// SPDX-License-Identifier: Apache-2.0
// Options that a component declares (settings/settings.h) on the command line.
#pragma once

#include <CLI/CLI.hpp>
#include <vector>

#include "settings/option.h"

namespace covary {

/// Adds the options to the command: what is given on its command line is put into `values`, by names without dashes and
/// checked as the declaration says. `values` must live as long as the command.
void add_options(CLI::App& command, const std::vector<Option>& options, OptionValues& values);

}  // namespace covary
