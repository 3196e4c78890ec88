// SPDX-License-Identifier: Apache-2.0
// Image files that a small library reads row by row from the top: what the PNG, JPEG and HDR readers share.
#pragma once

#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>

#include "imageio/image_io.h"

namespace covary {

/// An open file, header already read. Values are integers or linear floats. Functions throw Error if the file is
/// damaged.
struct PlainRows {
  virtual ~PlainRows() = default;
  /// Reads the next row: width * channels values of 8 bits, 16 bits or float, in native byte order.
  virtual void read_row(uint8_t* row) = 0;
  int width = 0, height = 0, channels = 0;  ///< 1: grey, 2: grey and alpha, 3: RGB, 4: RGB and alpha
  int bytes_per_value = 1;
};

using OpenRows = std::function<std::unique_ptr<PlainRows>(std::FILE*)>;

/// A reader for the file `path`, whose header reports `format` and no attributes; nullptr if `open` throws Error.
std::unique_ptr<ImageReader> open_plain_rows(const std::string& path, const char* format, OpenRows open);

/// Reads an HDR file (32-bit_rle_rgbe, rows from the top down) to the same bits as OpenImageIO, without attributes;
/// nullptr for any other file. Format: G. Ward, Real Pixels, in: Graphics Gems II, 1991.
std::unique_ptr<ImageReader> open_plain_hdr(const std::string& path);

/// Reads a JPEG file to the same bits as OpenImageIO, without attributes; nullptr if it is not JPEG, is damaged, or is
/// neither grey nor RGB.
std::unique_ptr<ImageReader> open_plain_jpeg(const std::string& path);

}  // namespace covary
