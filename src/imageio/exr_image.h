// SPDX-License-Identifier: Apache-2.0
// Textures and environment maps in EXR without OpenImageIO, which takes longer to load than most of them to read.
#pragma once

#include <memory>
#include <string>

#include "imageio/image_io.h"

namespace covary {

/// Opens an EXR file of one part with channels R, G, B and perhaps A, or Y and perhaps A, all of the same type, half or
/// float. Null for any other file, which OpenImageIO may know more about; also for damaged ones. The header of the file
/// was checked (exr_header.h).
std::unique_ptr<ImageReader> open_plain_exr(const std::string& path);

}  // namespace covary
