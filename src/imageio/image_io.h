// SPDX-License-Identifier: Apache-2.0
// Image files in every format that OpenImageIO knows. OpenImageIO brings in some 250 shared libraries, which take
// longer to load than a small scene takes to render, so it lives in a shared module, libcovary_imageio.so, loaded only
// when a function of this header needs it. Ordinary EXR files, films, PNG, JPEG and HDR textures and PNG output do
// without it: imageio/exr_image.h, film/exr.h, imageio/png.h, imageio/plain_rows.h.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace covary {

/// Header of an image file.
struct ImageHeader {
  std::string format;         ///< OpenImageIO's name: "png", "jpeg", "hdr", …
  std::string compression;    ///< "" if the format has none or does not tell
  int width = 0, height = 0;  ///< size of the stored pixels (data window), at least 1
  int x = 0, y = 0;           ///< their top left corner, relative to the frame (display window)
  int frame_width = 0, frame_height = 0;
  std::string type;             ///< of one value: "uint8", "uint16", "half", "float", …
  bool floating_point = false;  ///< linear: half, float, or integers of EXR; otherwise sRGB-encoded integers
  std::vector<std::string> channels;
  int alpha_channel = -1;                         ///< index into `channels`; -1: none
  int n_picture = 0;                              ///< the first so many channels are the picture (EXR); 0: unknown
  bool straight_alpha = false;                    ///< colours are not multiplied by alpha
  std::map<std::string, std::string> attributes;  ///< those whose values are text
};

/// An open image file, first picture only. The claimed size was checked against the file's size before reading any
/// pixel.
class ImageReader {
 public:
  virtual ~ImageReader() = default;
  const ImageHeader& header() const { return header_; }
  size_t n_pixels() const { return static_cast<size_t>(header_.width) * static_cast<size_t>(header_.height); }

  /// Channels [first, last) of all pixels, interleaved, row by row from the top; integers are scaled to [0, 1], but
  /// for EXR. Colours
  /// are as stored, not premultiplied by alpha. Throws Error(kInput) if the file is damaged.
  std::vector<float> read_floats(int first, int last) { return read_floats(first, last, 0, header_.height); }
  /// The same as bytes; only for files of type "uint8".
  std::vector<uint8_t> read_bytes(int first, int last) { return read_bytes(first, last, 0, header_.height); }

  /// Whether reading some of the rows takes less memory than reading all.
  bool has_rows() const { return has_rows_; }
  /// The same for `n_rows` rows starting at `first_row`; all rows are decoded if has_rows() is false. Read rows from
  /// the top down: many formats restart from the top to go back.
  std::vector<float> read_floats(int first, int last, int first_row, int n_rows);
  std::vector<uint8_t> read_bytes(int first, int last, int first_row, int n_rows);

 protected:
  struct Part {
    int first, last;        ///< channels
    int first_row, n_rows;  ///< numbered from 0
  };
  /// Fills `values`; on failure sets `problem` and returns false. Does not throw: exceptions must not leave the module.
  virtual bool read(const Part& part, float* values, std::string& problem) = 0;
  virtual bool read(const Part& part, uint8_t* values, std::string& problem) = 0;
  ImageHeader header_;
  std::string path_;
  bool has_rows_ = false;

 private:
  template <typename T>
  std::vector<T> read_part(const Part& part);
};

/// What to do with colours that are not stored as RGB, such as CMYK. kKeep is for textures; PNG, JPEG and HDR files
/// then have no attributes, just as when the module is missing.
enum class OtherColours { kConvert, kKeep };

/// Opens the first picture of a file. Throws Error naming the file: kIo if it cannot be opened; kInput if it is not an
/// image, is damaged, empty, a volume or deep, or claims more pixels than a file of its size can hold.
std::unique_ptr<ImageReader> open_image(const std::string& path, OtherColours colours = OtherColours::kConvert);

/// Pixels to write: `channels` (1: grey, 3: RGB, 4: RGB multiplied by alpha, and alpha) interleaved values per pixel,
/// row by row from the top. Exactly one of `bytes` and `floats` is set; neither is owned.
struct ImageToEncode {
  int width = 0, height = 0, channels = 3;
  const uint8_t* bytes = nullptr;                 ///< sRGB-encoded
  const float* floats = nullptr;                  ///< linear
  std::map<std::string, std::string> attributes;  ///< text, written if the format supports it
  int quality = 95;                               ///< 1 to 100; JPEG only
};

/// Encodes a file in the format of `extension` ("jpg", "tif", "hdr", "pfm", …, without the dot). Throws Error(kIo) if
/// the format is unknown or cannot hold these values.
std::vector<unsigned char> encode_image(const std::string& extension, const ImageToEncode& image);

}  // namespace covary
