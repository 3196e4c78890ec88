// SPDX-License-Identifier: Apache-2.0
// PNG files with libpng, which loads quickly, unlike the module behind image_io.h.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace covary {

class ImageReader;

/// Reads a PNG file to the same bits as OpenImageIO, without attributes; nullptr if it is not PNG, is damaged or
/// interlaced.
std::unique_ptr<ImageReader> open_plain_png(const std::string& path);

/// Encodes a PNG file of `width` x `height` pixels, three sRGB-encoded bytes each, or four with alpha (by which the
/// colours are not multiplied), row by row from the top left. `texts` become text chunks: keywords of 1 to 79 Latin-1
/// characters, UTF-8 values. Throws Error(kIo) if libpng refuses the size or a keyword.
std::vector<unsigned char> encode_png(int width, int height, const std::vector<uint8_t>& pixels,
                                      const std::map<std::string, std::string>& texts = {});

/// The same row by row, in little memory.
class PngRowWriter {
 public:
  using Sink = std::function<void(const void* data, size_t size)>;
  /// `sink` gets the file's bytes in their order.
  PngRowWriter(int width, int height, bool has_alpha, const std::map<std::string, std::string>& texts, Sink sink);
  ~PngRowWriter();
  PngRowWriter(const PngRowWriter&) = delete;
  PngRowWriter& operator=(const PngRowWriter&) = delete;
  void write_row(const uint8_t* pixels);
  /// Call after the last row.
  void finish();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// The text chunks of a PNG file; empty if the file does not exist or is not a readable PNG file.
std::map<std::string, std::string> read_png_texts(const std::string& path);

}  // namespace covary
