// SPDX-License-Identifier: Apache-2.0
#include "imageio/plain_rows.h"

#include <cstdio>

#include <jpeglib.h>

#include <jerror.h>

#include <array>

#include "core/error.h"

namespace covary {
namespace {

// libjpeg requires that its error function does not return. The exception unwinds through libjpeg; the destructor below
// frees its structures.
[[noreturn]] void throw_jpeg_error(j_common_ptr jpeg) {
  std::array<char, JMSG_LENGTH_MAX> message{};
  jpeg->err->format_message(jpeg, message.data());
  throw Error(ErrorCode::kInput, message.data());
}
/// Level -1 is a warning. Only a truncated file counts as an error: the rest of the picture would be grey.
void note(j_common_ptr jpeg, int level) {
  if (level < 0 && jpeg->err->msg_code == JWRN_JPEG_EOF) throw_jpeg_error(jpeg);
}

/// A grey or RGB file.
class JpegRows final : public PlainRows {
 public:
  explicit JpegRows(std::FILE* file) {
    jpeg_.err = jpeg_std_error(&errors_);
    errors_.error_exit = throw_jpeg_error;
    errors_.emit_message = note;
    jpeg_create_decompress(&jpeg_);
    try {
      start(file);
    } catch (...) {
      jpeg_destroy_decompress(&jpeg_);
      throw;
    }
  }
  ~JpegRows() override { jpeg_destroy_decompress(&jpeg_); }
  JpegRows(const JpegRows&) = delete;
  JpegRows& operator=(const JpegRows&) = delete;

  void read_row(uint8_t* row) override { jpeg_read_scanlines(&jpeg_, &row, 1); }

 private:
  void start(std::FILE* file) {
    jpeg_stdio_src(&jpeg_, file);
    jpeg_read_header(&jpeg_, TRUE);
    if (jpeg_.out_color_space != JCS_GRAYSCALE && jpeg_.out_color_space != JCS_RGB)
      throw Error(ErrorCode::kInput, "it is neither grey nor RGB");
    jpeg_start_decompress(&jpeg_);
    width = static_cast<int>(jpeg_.output_width), height = static_cast<int>(jpeg_.output_height);
    channels = jpeg_.output_components;
  }

  jpeg_error_mgr errors_{};
  jpeg_decompress_struct jpeg_{};
};

}  // namespace

std::unique_ptr<ImageReader> open_plain_jpeg(const std::string& path) {
  return open_plain_rows(path, "jpeg", [](std::FILE* file) { return std::make_unique<JpegRows>(file); });
}

}  // namespace covary
