// SPDX-License-Identifier: Apache-2.0
// Image files whose rows a small library reads from the top down: what png.h, plain_rows.h and plain_rows.h share.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "imageio/image_io.h"

namespace covary {

/// An open file behind its header: integers, or linear floats. Functions throw Error where it is damaged.
struct PlainRows {
  virtual ~PlainRows() = default;
  /// The next row: width * channels values of 8 bits, or of 16 or floats in this machine's order.
  virtual void read_row(uint8_t* row) = 0;
  int width = 0, height = 0, channels = 0;  ///< 1: grey, 2: grey and alpha, 3: RGB, 4: RGB and alpha
  int bytes_per_value = 1;
};

using OpenRows = std::function<std::unique_ptr<PlainRows>(std::FILE*)>;

/// A reader of the file `path`, whose header has the name of the format and no attributes; nullptr where `open` throws
/// Error.
std::unique_ptr<ImageReader> open_plain_rows(const std::string& path, const char* format, OpenRows open);

/// The pixels that OpenImageIO reads of an HDR file (32-bit_rle_rgbe, rows from the top down), to the same bits;
/// without attributes. nullptr where it is another file. Format: G. Ward, Real Pixels, in: Graphics Gems II, 1991.
std::unique_ptr<ImageReader> open_plain_hdr(const std::string& path);

/// The pixels that OpenImageIO reads of a JPEG file, to the same bits; without attributes. nullptr where it is not a
/// JPEG file, damaged, or neither grey nor RGB.
std::unique_ptr<ImageReader> open_plain_jpeg(const std::string& path);

}  // namespace covary
