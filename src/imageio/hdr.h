// SPDX-License-Identifier: Apache-2.0
// Radiance's HDR files: quick to load, other than the module behind image_io.h.
#pragma once

#include <memory>
#include <string>

namespace covary {

class ImageReader;

/// The pixels that OpenImageIO reads of an HDR file (32-bit_rle_rgbe, rows from the top down), to the same bits;
/// without attributes. nullptr where it is another file. Format: G. Ward, Real Pixels, in: Graphics Gems II, 1991.
std::unique_ptr<ImageReader> open_plain_hdr(const std::string& path);

}  // namespace covary
