// SPDX-License-Identifier: Apache-2.0
// Reasons to doubt a comparison, for every command that compares images.
#pragma once

#include <string>
#include <vector>

namespace covary {

/// Prints, as warnings, reasons in the files to doubt each image or its errors against the references (none, one or
/// two); reasons about the references come first. Each is printed once. Returns those of each image.
std::vector<std::vector<std::string>> warn_of_comparison(const std::vector<std::string>& images,
                                                         const std::vector<std::string>& references);

}  // namespace covary
