// SPDX-License-Identifier: Apache-2.0
#include "imageio/exr_image.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputPart.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/error.h"
#include "imageio/exr_picture.h"

namespace covary {
namespace Imf = OPENEXR_IMF_NAMESPACE;
namespace {

constexpr int kMaxSize = 1 << 18;  // pixels per side; larger images are left to OpenImageIO

bool has_plain_size(const Imath::Box2i& window) {
  const auto fits = [](int64_t low, int64_t high) { return high >= low && high - low < kMaxSize; };
  return fits(window.min.x, window.max.x) && fits(window.min.y, window.max.y);
}

std::vector<ExrPart> parts_of(const Imf::MultiPartInputFile& file) {
  std::vector<ExrPart> parts;
  for (int i = 0; i < file.parts(); ++i) {
    const Imf::Header& header = file.header(i);
    ExrPart part{header.hasName() ? header.name() : "", {}, header.hasType() && Imf::isDeepData(header.type())};
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c)
      part.channels.push_back({c.name(), c.channel().xSampling != 1 || c.channel().ySampling != 1});
    parts.push_back(std::move(part));
  }
  return parts;
}

const char* type_name(Imf::PixelType type) {
  return type == Imf::HALF ? "half" : (type == Imf::UINT ? "uint" : "float");
}

class ExrReader final : public ImageReader {
 public:
  ExrReader(const std::string& path, std::unique_ptr<Imf::MultiPartInputFile> file, const ExrPicture& picture)
      : file_(std::move(file)), part_(picture.part) {
    const Imf::Header& header = file_->header(part_);
    const Imath::Box2i &data = header.dataWindow(), &frame = header.displayWindow();
    path_ = path;
    has_rows_ = true;
    header_.format = "openexr";
    header_.width = data.max.x - data.min.x + 1, header_.height = data.max.y - data.min.y + 1;
    header_.x = data.min.x - frame.min.x, header_.y = data.min.y - frame.min.y;
    header_.frame_width = frame.max.x - frame.min.x + 1, header_.frame_height = frame.max.y - frame.min.y + 1;
    header_.type = type_name(header.channels().findChannel(picture.channels[0])->type);
    header_.floating_point = true;  // linear, integers too
    header_.channels = picture.channels;
    header_.n_picture = static_cast<int>(picture.channels.size());
    const std::string& first = picture.channels[0];
    const std::string alpha = first.substr(0, first.rfind('.') + 1) + "A";  // of the same layer
    for (auto c = header.channels().begin(); c != header.channels().end(); ++c) {
      if (std::ranges::find(picture.channels, c.name()) == picture.channels.end())
        header_.channels.emplace_back(c.name());
      if (header_.channels.back() == alpha) header_.alpha_channel = static_cast<int>(header_.channels.size()) - 1;
    }
    for (auto a = header.begin(); a != header.end(); ++a)
      if (const auto* text = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
        header_.attributes[a.name()] = text->value();
  }

 private:
  bool read(const Part& part, float* values, std::string& problem) override {
    try {
      Imf::InputPart input(*file_, part_);
      Imath::Box2i window = input.header().dataWindow();
      window.min.y += part.first_row;
      window.max.y = window.min.y + part.n_rows - 1;
      const auto stride = sizeof(float) * static_cast<size_t>(part.last - part.first);
      Imf::FrameBuffer buffer;
      for (int c = part.first; c < part.last; ++c)
        buffer.insert(header_.channels[static_cast<size_t>(c)],
                      Imf::Slice::Make(Imf::FLOAT, values + (c - part.first), window, stride,
                                       stride * static_cast<size_t>(header_.width)));
      input.setFrameBuffer(buffer);
      input.readPixels(window.min.y, window.max.y);
      return true;
    } catch (const std::exception& error) {
      problem = error.what();
      std::ranges::replace(problem, '\n', ' ');
      return false;
    }
  }
  bool read(const Part&, uint8_t*, std::string& problem) override {
    problem = "its values are no bytes";
    return false;
  }

  std::unique_ptr<Imf::MultiPartInputFile> file_;
  int part_;
};

}  // namespace

std::unique_ptr<ImageReader> open_exr(const std::string& path) {
  std::unique_ptr<Imf::MultiPartInputFile> file;
  std::vector<ExrPart> parts;
  try {
    file = std::make_unique<Imf::MultiPartInputFile>(path.c_str(), 0);
    parts = parts_of(*file);
  } catch (const std::exception&) {
    return nullptr;
  }
  if (std::ranges::all_of(parts, &ExrPart::deep)) return nullptr;
  const ExrPicture picture = find_exr_picture(parts, path);
  const Imf::Header& header = file->header(picture.part);
  if (!has_plain_size(header.dataWindow()) || !has_plain_size(header.displayWindow())) return nullptr;
  return std::make_unique<ExrReader>(path, std::move(file), picture);
}

namespace {

constexpr unsigned char kMagic[4] = {0x76, 0x2f, 0x31, 0x01};
constexpr uint32_t kMultiPart = 0x1000;  // flag in the version field
constexpr size_t kLongestName = 255;

constexpr int kLastCompression = Imf::NUM_COMPRESSION_METHODS - 1;

/// Of later versions of OpenEXR (ImfCompression.h of 3.4 and 3.5).
std::string new_compression(int number) {
  switch (number) {
    case 10:
      return "HTJ2K256 (of OpenEXR 3.4)";
    case 11:
      return "HTJ2K32 (of OpenEXR 3.4)";
    case 12:
      return "LJ2K (of OpenEXR 3.5)";
    case 13:
      return "ZSTD (of OpenEXR 3.5)";
    default:
      return fmt::format("number {}", number);
  }
}

class HeaderCheck {
 public:
  explicit HeaderCheck(const std::string& path) : path_(path), file_(nullptr, &std::fclose) {
    std::error_code ignored;
    const bool regular = std::filesystem::is_regular_file(path, ignored);
    if (!regular && std::filesystem::exists(path, ignored)) {  // opening a named pipe could block forever
      const bool folder = std::filesystem::is_directory(path, ignored);
      throw Error(ErrorCode::kIo,
                  fmt::format("cannot read {}: {}", path, folder ? "it is a folder" : "not a regular file"));
    }
    file_.reset(std::fopen(path.c_str(), "rb"));
    if (!file_)
      throw Error(ErrorCode::kIo, fmt::format("cannot read {}: {}", path.empty() ? "''" : path, std::strerror(errno)));
    left_ = size_ = std::filesystem::file_size(path, ignored);
  }

  /// The first bytes of the file, or fewer if it is shorter.
  std::vector<unsigned char> magic() {
    std::vector<unsigned char> bytes(4);
    bytes.resize(std::fread(bytes.data(), 1, bytes.size(), file_.get()));
    left_ -= bytes.size();
    return bytes;
  }

  void check() {
    magic();
    const uint32_t version = whole_number();
    if (!(version & kMultiPart)) {
      check_part();
      return;
    }
    is_multipart_ = true;
    while (check_part()) {  // an empty header follows the last part
    }
  }

  /// After check(): whether the chunk that is stored last is whole. The tables of offsets, which fill the file up to
  /// the first chunk, must be complete. Throws Error(kInput) if the file ends before.
  bool has_last_chunk(const Imf::MultiPartInputFile& file) {
    const uint64_t table = size_ - left_;
    uint64_t first = size_, last = 0;
    for (uint64_t at = table; at < first; at += sizeof(uint64_t)) {
      const uint64_t offset = long_number();
      first = std::min(first, offset), last = std::max(last, offset);
    }
    if (last < table || last >= size_ || std::fseek(file_.get(), static_cast<long>(last), SEEK_SET) != 0) return false;
    left_ = size_ - last;
    const uint32_t part = is_multipart_ ? whole_number() : 0;
    if (part >= static_cast<uint32_t>(file.parts())) return false;
    const Imf::Header& header = file.header(static_cast<int>(part));
    const bool is_deep = header.hasType() && Imf::isDeepData(header.type());
    for (int n = header.hasTileDescription() ? 4 : 1; n > 0; --n) whole_number();  // place in the image
    if (!is_deep) return whole_number() <= left_;
    const uint64_t counts = long_number(), samples = long_number();
    long_number();  // size when unpacked
    return counts <= left_ && samples <= left_ - counts;
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kInput, fmt::format("{}: damaged EXR file: {}", path_, what));
  }

  /// Checks the attributes of one part; false if there are none.
  bool check_part() {
    bool any = false;
    for (std::string name = text(); !name.empty(); name = text(), any = true) {
      const std::string type = text();
      const uint32_t size = whole_number();
      if (size > left_)
        fail(fmt::format("the attribute '{}' claims {} bytes; {} bytes of the file are left", name, size, left_));
      if (type == "stringvector" || type == "preview" || type == "compression") {
        std::vector<char> value(size);
        if (std::fread(value.data(), 1, size, file_.get()) != size) fail("the file ends in its header");
        check_value(name, type, value);
      } else if (std::fseek(file_.get(), static_cast<long>(size), SEEK_CUR) != 0) {
        fail("the file ends in its header");
      }
      left_ -= size;
    }
    return any;
  }

  /// Checks the values that carry sizes of their own.
  void check_value(const std::string& name, const std::string& type, const std::vector<char>& value) const {
    const auto number_at = [&](size_t at) {
      uint32_t number = 0;
      if (at + sizeof(number) > value.size()) fail(fmt::format("the attribute '{}' ends early", name));
      std::memcpy(&number, value.data() + at, sizeof(number));
      return number;
    };
    if (type == "compression") {
      const int number = value.empty() ? -1 : static_cast<unsigned char>(value[0]);
      if (number > kLastCompression)
        throw Error(ErrorCode::kInput,
                    fmt::format("{}: compression {}, which is newer than this program's OpenEXR; save "
                                "the file with another one, e.g. ZIP or PIZ",
                                path_, new_compression(number)));
      return;
    }
    if (type == "preview") {
      const uint64_t width = number_at(0), height = number_at(4);
      if (width > value.size() || height > value.size() || 8 + 4 * width * height != value.size())
        fail(fmt::format("the preview claims {} x {} pixels in {} bytes", width, height, value.size()));
      return;
    }
    for (size_t at = 0; at < value.size();) {
      const uint32_t length = number_at(at);
      at += sizeof(length);
      if (length > value.size() - at)
        fail(fmt::format("a text of the attribute '{}' claims {} bytes; {} bytes are left", name, length,
                         value.size() - at));
      at += length;
    }
  }

  int byte() {
    if (left_ == 0) fail("the file ends in its header");
    --left_;
    const int c = std::getc(file_.get());
    if (c == EOF) fail("the file ends in its header");
    return c;
  }
  /// Reads up to the next zero byte.
  std::string text() {
    std::string result;
    while (const int c = byte()) {
      result += static_cast<char>(c);
      if (result.size() > kLongestName) fail(fmt::format("a name is longer than {} characters", kLongestName));
    }
    return result;
  }
  /// Little-endian, as all numbers in EXR.
  uint32_t whole_number() {
    uint32_t number = 0;
    for (int shift = 0; shift < 32; shift += 8) number |= static_cast<uint32_t>(byte()) << shift;
    return number;
  }

  uint64_t long_number() {
    const uint64_t low = whole_number();
    return low | static_cast<uint64_t>(whole_number()) << 32;
  }

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  uint64_t size_ = 0, left_ = 0;  // bytes of the file, and those left to read
  bool is_multipart_ = false;
};

}  // namespace

bool is_exr(const std::string& path) {
  const std::vector<unsigned char> magic = HeaderCheck(path).magic();
  return magic.size() == sizeof(kMagic) && std::memcmp(magic.data(), kMagic, sizeof(kMagic)) == 0;
}

void check_exr_header(const std::string& path) { HeaderCheck(path).check(); }

bool is_complete_exr(const std::string& path) try {
  HeaderCheck header(path);
  header.check();
  const Imf::MultiPartInputFile file(path.c_str(), 0);
  for (int part = 0; part < file.parts(); ++part)
    if (!file.partComplete(part)) return false;
  return header.has_last_chunk(file);
} catch (const std::exception&) {
  return false;
}

}  // namespace covary
