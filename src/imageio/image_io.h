// SPDX-License-Identifier: Apache-2.0
// Image files in every format OpenImageIO knows. OpenImageIO brings some 250 shared libraries, which take longer to
// load than a small scene to render. So it lies behind a shared module, libcovary_imageio.so, which is loaded when a
// function of this header needs it. EXR files of ordinary channels, films, textures in PNG, JPEG and HDR, and PNG files
// that are written do not: imageio/exr_image.h, film/exr.h, imageio/png.h, imageio/plain_rows.h.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace covary {

/// What an image file says of itself.
struct ImageHeader {
  std::string format;         ///< OpenImageIO's name: "png", "jpeg", "hdr", …
  std::string compression;    ///< "" when the format has none or does not tell
  int width = 0, height = 0;  ///< pixels that the file holds, at least 1
  int x = 0, y = 0;           ///< their corner, relative to the frame's
  int frame_width = 0, frame_height = 0;
  std::string type;             ///< of a value: "uint8", "uint16", "half", "float", …
  bool floating_point = false;  ///< half or float: linear values; otherwise integers, encoded with the sRGB curve
  std::vector<std::string> channels;
  int alpha_channel = -1;                         ///< index into `channels`; -1: none
  std::map<std::string, std::string> attributes;  ///< those that are texts
};

/// An open image file of one picture. What the file claims was checked against its size before any pixel is read.
class ImageReader {
 public:
  virtual ~ImageReader() = default;
  const ImageHeader& header() const { return header_; }
  size_t n_pixels() const { return static_cast<size_t>(header_.width) * static_cast<size_t>(header_.height); }

  /// Channels [first, last) of all pixels, interleaved, row by row from the top; integers scaled to [0, 1]. Colours are
  /// as stored: not multiplied by alpha. Throws Error(kInput) when the file is damaged.
  std::vector<float> read_floats(int first, int last) { return read_floats(first, last, 0, header_.height); }
  /// The same as bytes; for files of the type "uint8".
  std::vector<uint8_t> read_bytes(int first, int last) { return read_bytes(first, last, 0, header_.height); }

  /// Whether some rows take less memory than all.
  bool has_rows() const { return has_rows_; }
  /// The same of `n_rows` rows from `first_row` on; all of them where has_rows() is false. Rows are best read from the
  /// top down: many formats begin anew to go back.
  std::vector<float> read_floats(int first, int last, int first_row, int n_rows);
  std::vector<uint8_t> read_bytes(int first, int last, int first_row, int n_rows);

 protected:
  struct Part {
    int first, last;        ///< channels
    int first_row, n_rows;  ///< from 0 on
  };
  /// Fills `values`; false after setting `problem`. Never throws: a module may not throw into the program.
  virtual bool read(const Part& part, float* values, std::string& problem) = 0;
  virtual bool read(const Part& part, uint8_t* values, std::string& problem) = 0;
  ImageHeader header_;
  std::string path_;
  bool has_rows_ = false;

 private:
  template <typename T>
  std::vector<T> read_part(const Part& part);
};

/// Colours that a file does not store as RGB, such as CMYK. kKeep is for textures: PNG, JPEG and HDR files then have
/// no attributes, as they have none anyway where the module is missing.
enum class OtherColours { kConvert, kKeep };

/// Opens the first picture of a file. Throws Error with the file's name: kIo when it cannot be opened, kInput when it
/// is not an image, damaged, empty, a volume, deep, or claims more pixels than a file of its size can hold.
std::unique_ptr<ImageReader> open_image(const std::string& path, OtherColours colours = OtherColours::kConvert);

/// Pixels to be written: `channels` (1: grey, 3: RGB) interleaved values a pixel, row by row from the top. Exactly one
/// of `bytes` and `floats` is set; it is only read.
struct ImageToEncode {
  int width = 0, height = 0, channels = 3;
  const uint8_t* bytes = nullptr;                 ///< encoded with the sRGB curve
  const float* floats = nullptr;                  ///< linear
  std::map<std::string, std::string> attributes;  ///< texts, kept where the format can
  int quality = 95;                               ///< 1 to 100; JPEG only
};

/// The content of a file in the format that `extension` names ("jpg", "tif", "hdr", "pfm", …, without dot). Throws
/// Error(kIo) when the format is unknown or cannot hold these values.
std::vector<unsigned char> encode_image(const std::string& extension, const ImageToEncode& image);

}  // namespace covary
