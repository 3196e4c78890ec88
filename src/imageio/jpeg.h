// SPDX-License-Identifier: Apache-2.0
// JPEG files by libjpeg: quick to load, other than the module behind image_io.h.
#pragma once

#include <memory>
#include <string>

namespace covary {

class ImageReader;

/// The pixels that OpenImageIO reads of a JPEG file, to the same bits; without attributes. nullptr where it is not a
/// JPEG file, damaged, or neither grey nor RGB.
std::unique_ptr<ImageReader> open_plain_jpeg(const std::string& path);

}  // namespace covary
