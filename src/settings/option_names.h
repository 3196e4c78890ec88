// SPDX-License-Identifier: Apache-2.0
// The library puts option names in backquotes: "`cv-grid` has no effect with `cv` off". Each front end shows them as
// its users write them.
#pragma once

#include <string>
#include <vector>

#include "settings/option.h"

namespace covary {

/// "--cv-grid has no effect with --cv off"
std::string as_flags(const std::string& text);
/// Whether the option of a method (integrator or estimator) is a parameter, on the command line `--set NAME=VALUE`: has
/// a value, and is not one that everybody needs.
bool is_parameter(const Option& option);
/// The same text, but parameters are shown as `--set` has them: "--set cv-grid has no effect with --set cv=off"
std::string as_flags(const std::string& text, const std::vector<Option>& parameters);
/// The given options of a method as words of a command line, in order of declaration: "--paper", "--set", "k=50".
std::vector<std::string> method_words(const std::vector<Option>& options, const OptionValues& values);
/// "cv_grid has no effect with cv off"
std::string as_arguments(const std::string& text);

}  // namespace covary
