// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace covary {

struct LiveOptions {
  bool live = false;
  int port = 0;  ///< 0: any free one; a port alone asks for the page, too
  bool wanted() const { return live || port != 0; }
};

/// --live and --live-port. `help`: of the former.
void add_live_options(CLI::App& command, LiveOptions& options, const std::string& help);

}  // namespace covary
