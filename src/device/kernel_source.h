// SPDX-License-Identifier: Apache-2.0
// The texts of kernels, which are part of the program (device/kernels).
#pragma once

#include <string>
#include <vector>

namespace covary::device {

/// Names of the kernel files, "sum.cl", without the headers among them.
std::vector<std::string> kernel_names();

/// The text of a kernel file with each `#include "name"` of another one replaced by that file, once. Throws
/// Error(kInternal) for a name that there is not.
std::string kernel_source(const std::string& name);

}  // namespace covary::device
