// SPDX-License-Identifier: Apache-2.0
// Reads EXR textures and environment maps without OpenImageIO, which takes longer to load than most of them to read.
#pragma once

#include <memory>
#include <string>

#include "imageio/image_io.h"

namespace covary {

/// Opens the picture of an EXR file (exr_picture.h), whose channels come first in the header, as ImageHeader::n_picture
/// says. Integers are not scaled: they are values, as everywhere in EXR. Throws Error(kInput) if it is not clear which
/// channels are the picture. Returns null for deep pixels and for damaged or huge files, which are left to OpenImageIO.
/// check_exr_header() must have accepted the file.
std::unique_ptr<ImageReader> open_exr(const std::string& path);

// Checks the header of an EXR file before OpenEXR reads it: OpenEXR allocates whatever the header's attributes claim,
// regardless of the file's size.

/// Whether the file has EXR's magic number, whatever its name. Throws Error(kIo) if it cannot be opened.
bool is_exr(const std::string& path);

/// Throws Error(kInput) if an attribute claims more bytes than the file has, or if the header does not end.
void check_exr_header(const std::string& path);

/// Whether a program has finished writing or copying the file: the table of its pixels, which is written last, is
/// filled, and the pixels that are stored last are there. False for files that cannot be read.
bool is_complete_exr(const std::string& path);

}  // namespace covary
