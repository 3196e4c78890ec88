// SPDX-License-Identifier: Apache-2.0
// The module libcovary_imageio.so: implements image_io.h with OpenImageIO.
#include <OpenImageIO/imageio.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <exception>
#include <fstream>
#include <iterator>
#include <mutex>
#include <system_error>
#include <utility>

#include "imageio/image_module.h"

namespace covary {
namespace {

/// OpenImageIO's message on one line.
std::string one_line(std::string text) {
  text.erase(text.find_last_not_of(" \n") + 1);
  for (size_t at = text.find('\n'); at != std::string::npos; at = text.find('\n', at)) text.replace(at, 1, "; ");
  return text.empty() ? "OpenImageIO gives no reason" : text;
}

/// Held while OpenImageIO opens, closes or writes a file: version 2.4 decodes EXIF, ICC and XMP into tables shared by
/// all threads, and adds to them without a lock (its issue 3756). Pixels are read without it.
std::mutex& metadata_mutex() {
  static std::mutex mutex;
  return mutex;
}

class OiioReader final : public ImageReader {
 public:
  OiioReader(const std::string& path, std::unique_ptr<OIIO::ImageInput> input) : input_(std::move(input)) {
    path_ = path;
    const OIIO::ImageSpec& spec = input_->spec();
    header_.format = input_->format_name();
    header_.width = spec.width, header_.height = spec.height;
    header_.x = spec.x - spec.full_x, header_.y = spec.y - spec.full_y;
    header_.frame_width = spec.full_width, header_.frame_height = spec.full_height;
    header_.type = spec.format.c_str();
    header_.floating_point = spec.format.is_floating_point();
    header_.channels.assign(spec.channelnames.begin(), spec.channelnames.end());
    header_.alpha_channel = spec.alpha_channel;
    header_.straight_alpha = spec.get_int_attribute("oiio:UnassociatedAlpha") != 0;
    has_rows_ = spec.tile_width == 0;
    for (const OIIO::ParamValue& value : spec.extra_attribs) {
      if (value.name() == "compression") header_.compression = value.get_string();
      if (value.type() == OIIO::TypeDesc::STRING) header_.attributes[value.name().string()] = value.get_string();
    }
  }
  ~OiioReader() override {
    const std::lock_guard lock(metadata_mutex());
    input_.reset();
  }

 private:
  bool read(const Part& part, float* values, std::string& problem) override {
    return read_as(part, OIIO::TypeDesc::FLOAT, values, problem);
  }
  bool read(const Part& part, uint8_t* values, std::string& problem) override {
    return read_as(part, OIIO::TypeDesc::UINT8, values, problem);
  }
  bool read_as(const Part& part, OIIO::TypeDesc type, void* values, std::string& problem) {
    std::unique_lock lock(metadata_mutex(), std::defer_lock);
    if (part.first_row < next_row_) lock.lock();  // some formats reopen the file to go back
    next_row_ = part.first_row + part.n_rows;
    const int y = input_->spec().y + part.first_row;
    try {
      if (part.n_rows == header_.height
              ? input_->read_image(0, 0, part.first, part.last, type, values)
              : input_->read_scanlines(0, 0, y, y + part.n_rows, 0, part.first, part.last, type, values))
        return true;
      problem = one_line(input_->geterror());
    } catch (const std::exception& error) {
      problem = error.what();
    }
    return false;
  }

  std::unique_ptr<OIIO::ImageInput> input_;
  int next_row_ = 0;
};

/// A file in memory. (OpenImageIO's own do not work for TIFF.)
class MemoryFile {
 public:
  explicit MemoryFile(const std::string& name) : file_(memfd_create(name.c_str(), MFD_CLOEXEC)) {
    if (file_ < 0) throw std::system_error(errno, std::generic_category(), "no file in memory");
  }
  ~MemoryFile() { close(file_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;

  std::string path() const { return "/proc/self/fd/" + std::to_string(file_); }
  std::vector<unsigned char> content() const {
    std::ifstream stream(path(), std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }

 private:
  int file_;
};

class OiioModule final : public ImageModule {
 public:
  std::unique_ptr<ImageReader> open(const std::string& path, OtherColours colours,
                                    std::string& problem) const override {
    const std::lock_guard lock(metadata_mutex());
    try {
      OIIO::ImageSpec config;
      config.attribute("oiio:UnassociatedAlpha", 1);  // do not premultiply by alpha
      if (colours == OtherColours::kKeep) config.attribute("oiio:RawColor", 1);
      auto input = OIIO::ImageInput::open(path, &config);
      if (!input) {
        problem = one_line(OIIO::geterror());
      } else if (input->spec().depth > 1 || input->spec().deep) {
        problem = input->spec().deep ? "it has deep pixels" : "it is a volume, not a picture";
      } else if (std::strcmp(input->format_name(), "FFmpeg movie") == 0) {  // whose reader writes past narrow frames
        problem = "it is a video; give its frames, e.g. of `ffmpeg -i VIDEO frame_%04d.png`";
      } else {
        return std::make_unique<OiioReader>(path, std::move(input));
      }
    } catch (const std::exception& error) {
      problem = error.what();
    }
    return nullptr;
  }

  std::vector<unsigned char> encode(const std::string& extension, const ImageToEncode& image,
                                    std::string& problem) const override {
    const std::lock_guard lock(metadata_mutex());
    try {
      const auto output = OIIO::ImageOutput::create("image." + extension);
      if (!output) {
        problem = one_line(OIIO::geterror());
        return {};
      }
      const OIIO::TypeDesc type = image.bytes ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
      OIIO::ImageSpec spec(image.width, image.height, image.channels, type);
      spec.attribute("oiio:ColorSpace", image.bytes ? "sRGB" : "Linear");
      spec.attribute("CompressionQuality", image.quality);
      for (const auto& [key, value] : image.attributes) spec.attribute(key, value);
      const void* values = image.bytes ? static_cast<const void*>(image.bytes) : image.floats;
      const MemoryFile file("image." + extension);
      if (!output->open(file.path(), spec) || !output->write_image(type, values) || !output->close())
        problem = one_line(output->geterror());
      return file.content();
    } catch (const std::exception& error) {
      problem = error.what();
      return {};
    }
  }
};

}  // namespace
}  // namespace covary

extern "C" __attribute__((visibility("default"))) const covary::ImageModule* covary_image_module_3() {
  static const covary::OiioModule module;
  return &module;
}
