// SPDX-License-Identifier: Apache-2.0
// Texts of the library name options in backquotes: "`cv-grid` has no effect with `cv` off". Programs show them by the
// names that their users know.
#pragma once

#include <string>

namespace covary {

/// "--cv-grid has no effect with --cv off"
std::string as_flags(const std::string& text);
/// "cv_grid has no effect with cv off"
std::string as_arguments(const std::string& text);

}  // namespace covary
