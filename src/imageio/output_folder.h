// SPDX-License-Identifier: Apache-2.0
// Folders of outputs: the last one of a name is made, if the one that holds it is there.
#pragma once

#include <string>

namespace covary {

/// Whether the folder is not there and can be made.
bool is_missing_folder(const std::string& folder);

/// Makes the folder unless it is there. Throws Error(kIo) if that is impossible, such as if the folder that is to hold
/// it does not exist.
void make_output_folder(const std::string& folder);

}  // namespace covary
