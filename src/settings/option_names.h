// SPDX-License-Identifier: Apache-2.0
// The library puts option names in backquotes: "`cv-grid` has no effect with `cv` off". Each front end shows them as
// its users write them.
#pragma once

#include <string>

namespace covary {

/// "--cv-grid has no effect with --cv off"
std::string as_flags(const std::string& text);
/// "cv_grid has no effect with cv off"
std::string as_arguments(const std::string& text);

}  // namespace covary
