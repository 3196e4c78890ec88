// SPDX-License-Identifier: Apache-2.0
// Reasons to doubt a comparison, for every command that compares images.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace covary {

/// Prints, as warnings, reasons in the files to doubt each image or its errors against the references (none, one or
/// two); reasons about the references come first. Returns those of each image. `printed`: what the command has printed,
/// which is not printed again. `may_have_two`: see reference_warnings().
std::vector<std::vector<std::string>> warn_of_comparison(const std::vector<std::string>& images,
                                                         const std::vector<std::string>& references,
                                                         std::set<std::string>& printed, bool may_have_two = true);

}  // namespace covary
