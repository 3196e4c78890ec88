// SPDX-License-Identifier: Apache-2.0
// Reasons to doubt a comparison, for every command that compares images.
#pragma once

#include <string>
#include <vector>

namespace covary {

/// Reasons in the files to doubt each image, or its errors against the references (none, one or two); those of the
/// references come first. Everything is printed once as a warning.
std::vector<std::vector<std::string>> warn_of_comparison(const std::vector<std::string>& images,
                                                         const std::vector<std::string>& references);

}  // namespace covary
