// SPDX-License-Identifier: Apache-2.0
#include "imageio/png.h"

#include <png.h>

#include <cstdio>
#include <memory>
#include <new>
#include <utility>

#include "core/error.h"
#include "imageio/plain_rows.h"

namespace covary {
namespace {

// libpng requires that its error function does not return. The exception unwinds through libpng, which holds nothing
// that needs freeing on the way; the destructors below free its structures.
[[noreturn]] void throw_png_error(png_structp, png_const_charp message) {
  throw Error(ErrorCode::kIo, std::string("PNG: ") + message);
}
void ignore_warning(png_structp, png_const_charp) {}

void send(png_structp png, png_bytep data, size_t size) {
  (*static_cast<PngRowWriter::Sink*>(png_get_io_ptr(png)))(data, size);
}
void no_flush(png_structp) {}

struct Writer {
  Writer() : png(png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, throw_png_error, ignore_warning)) {
    if (png) info = png_create_info_struct(png);
    if (!info) throw std::bad_alloc();
  }
  ~Writer() { png_destroy_write_struct(&png, &info); }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;
  png_structp png = nullptr;
  png_infop info = nullptr;
};

struct Reader {
  Reader() : png(png_create_read_struct(PNG_LIBPNG_VER_STRING, nullptr, throw_png_error, ignore_warning)) {
    if (png) info = png_create_info_struct(png);
    if (!info) throw std::bad_alloc();
  }
  ~Reader() { png_destroy_read_struct(&png, &info, nullptr); }
  Reader(const Reader&) = delete;
  Reader& operator=(const Reader&) = delete;
  png_structp png = nullptr;
  png_infop info = nullptr;
};

/// A file read row by row from the top as grey or RGB of 8 or 16 bits, with alpha if present.
class PngRows final : public PlainRows {
 public:
  explicit PngRows(std::FILE* file) {
    png_structp png = reader_.png;
    png_init_io(png, file);
    png_read_info(png, reader_.info);
    if (png_get_interlace_type(png, reader_.info) != PNG_INTERLACE_NONE)
      throw Error(ErrorCode::kInput, "it is interlaced");
    png_set_expand(png);  // palettes, fewer than 8 bits, a transparent colour key
    png_set_swap(png);    // PNG stores 16-bit values big-endian
    png_read_update_info(png, reader_.info);
    width = static_cast<int>(png_get_image_width(png, reader_.info));
    height = static_cast<int>(png_get_image_height(png, reader_.info));
    channels = png_get_channels(png, reader_.info);
    bytes_per_value = png_get_bit_depth(png, reader_.info) == 16 ? 2 : 1;
  }
  void read_row(uint8_t* row) override { png_read_row(reader_.png, row, nullptr); }

 private:
  const Reader reader_;
};

}  // namespace

std::unique_ptr<ImageReader> open_plain_png(const std::string& path) {
  return open_plain_rows(path, "png", [](std::FILE* file) { return std::make_unique<PngRows>(file); });
}

struct PngRowWriter::State {
  Sink sink;
  Writer writer;
};

PngRowWriter::PngRowWriter(int width, int height, bool has_alpha, const std::map<std::string, std::string>& texts,
                           Sink sink)
    : state_(std::make_unique<State>()) {
  COVARY_CHECK(width > 0 && height > 0, "a PNG has pixels");
  state_->sink = std::move(sink);
  const Writer& writer = state_->writer;
  png_set_write_fn(writer.png, &state_->sink, send, no_flush);
  png_set_IHDR(writer.png, writer.info, static_cast<png_uint_32>(width), static_cast<png_uint_32>(height), 8,
               has_alpha ? PNG_COLOR_TYPE_RGB_ALPHA : PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_sRGB(writer.png, writer.info, PNG_sRGB_INTENT_PERCEPTUAL);
  for (const auto& [key, value] : texts) {
    std::string keyword = key, text = value;  // libpng takes non-const text
    png_text chunk{};
    chunk.compression = PNG_ITXT_COMPRESSION_NONE;
    chunk.key = keyword.data(), chunk.text = text.data(), chunk.itxt_length = text.size();
    png_set_text(writer.png, writer.info, &chunk, 1);  // copies
  }
  png_write_info(writer.png, writer.info);
}

PngRowWriter::~PngRowWriter() = default;

void PngRowWriter::write_row(const uint8_t* pixels) { png_write_row(state_->writer.png, pixels); }

void PngRowWriter::finish() { png_write_end(state_->writer.png, nullptr); }

std::vector<unsigned char> encode_png(int width, int height, const std::vector<uint8_t>& pixels,
                                      const std::map<std::string, std::string>& texts) {
  const size_t n_pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
  const bool has_alpha = pixels.size() == 4 * n_pixels;
  COVARY_CHECK(has_alpha || pixels.size() == 3 * n_pixels, "three or four bytes a pixel");
  std::vector<unsigned char> content;
  PngRowWriter writer(width, height, has_alpha, texts, [&](const void* data, size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    content.insert(content.end(), bytes, bytes + size);
  });
  for (int y = 0; y < height; ++y) writer.write_row(pixels.data() + (has_alpha ? size_t{4} : 3) * width * y);
  writer.finish();
  return content;
}

std::map<std::string, std::string> read_png_texts(const std::string& path) {
  std::map<std::string, std::string> texts;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!file) return texts;
  try {
    const Reader reader;
    png_init_io(reader.png, file.get());
    png_read_info(reader.png, reader.info);
    png_textp chunks = nullptr;
    int n = 0;
    png_get_text(reader.png, reader.info, &chunks, &n);
    for (int i = 0; i < n; ++i) texts[chunks[i].key] = chunks[i].text ? chunks[i].text : "";
  } catch (const Error&) {
    texts.clear();
  }
  return texts;
}

}  // namespace covary
