// SPDX-License-Identifier: Apache-2.0
// Textures and environment maps in EXR without OpenImageIO, which takes longer to load than most of them to read.
#pragma once

#include <memory>
#include <string>

#include "imageio/image_io.h"

namespace covary {

/// Opens an EXR file of one part with channels R, G, B and perhaps A, or Y and perhaps A, all of the same type, half or
/// float. Null for any other file, which OpenImageIO may know more about; also for damaged ones. The header of the file
/// was checked by check_exr_header().
std::unique_ptr<ImageReader> open_plain_exr(const std::string& path);

// A look at the header of an EXR file before OpenEXR reads it: OpenEXR takes the memory that a header's attributes
// claim, whatever the size of the file.

/// Whether the file begins as every EXR file does, whatever it is called. Throws Error(kIo) when it cannot be opened.
bool is_exr(const std::string& path);

/// Throws Error(kInput) where an attribute of an EXR file claims more bytes than the file has, or the header does not
/// end.
void check_exr_header(const std::string& path);

}  // namespace covary
