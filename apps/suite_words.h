// SPDX-License-Identifier: Apache-2.0
// What the commands of a suite may say. A suite from elsewhere is data: its options choose methods and give numbers.
// None names a file, folder, library or server; commands after the render may read other images.
#pragma once

#include "lab/suite.h"

namespace covary {

/// Problems of one command of a suite: options that name something outside, by the declarations of the options; for
/// commands after the render also words that the program would refuse.
std::vector<lab::WordProblem> check_suite_command(const std::vector<std::string>& command);

}  // namespace covary
