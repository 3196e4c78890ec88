// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace covary {

/// Asks the desktop to open a file or an address; false if there is no desktop, or if it refuses. Without `wait`,
/// returns before the desktop has answered.
bool open_in_browser(const std::string& address, bool wait = true);

}  // namespace covary
