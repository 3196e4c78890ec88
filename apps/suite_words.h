// SPDX-License-Identifier: Apache-2.0
// What the commands of a suite may contain. A suite from elsewhere is data: its options choose methods and give
// numbers. None may name a file, folder, library or server; commands after the render may read other images.
#pragma once

#include "lab/suite.h"

namespace covary {

/// Problems of one command of a suite: options that name something outside, according to their declarations; for
/// commands after the render also words that the program would refuse.
std::vector<lab::WordProblem> check_suite_command(const std::vector<std::string>& command);

}  // namespace covary
