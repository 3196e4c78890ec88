// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace covary {

struct LiveOptions {
  std::string live;  ///< empty: no page; else its port, or "0" for any free one
  bool wanted() const { return !live.empty(); }
  int port() const { return std::stoi(live); }
};

/// --live, --live=PORT.
void add_live_options(CLI::App& command, LiveOptions& options, const std::string& help);

}  // namespace covary
