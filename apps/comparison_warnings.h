// SPDX-License-Identifier: Apache-2.0
// What makes a comparison doubtful, for every command that compares images.
#pragma once

#include <string>
#include <vector>

namespace covary {

/// What the files say that makes each image, or its errors against the references (none, one or two), doubtful; what is
/// wrong with the references stands first. Everything is printed once as a warning.
std::vector<std::vector<std::string>> warn_of_comparison(const std::vector<std::string>& images,
                                                         const std::vector<std::string>& references);

}  // namespace covary
