// SPDX-License-Identifier: Apache-2.0
// A look at the header of an EXR file before OpenEXR reads it: OpenEXR takes the memory that a header's attributes
// claim, whatever the size of the file.
#pragma once

#include <string>

namespace covary {

/// Whether the file begins as every EXR file does, whatever it is called. Throws Error(kIo) when it cannot be opened.
bool is_exr(const std::string& path);

/// Throws Error(kInput) where an attribute of an EXR file claims more bytes than the file has, or the header does not
/// end.
void check_exr_header(const std::string& path);

}  // namespace covary
