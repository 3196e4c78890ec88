// SPDX-License-Identifier: Apache-2.0
#include "imageio/exr_header.h"

#include <fmt/format.h>

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <vector>

#include "core/error.h"

namespace covary {
namespace {

constexpr unsigned char kMagic[4] = {0x76, 0x2f, 0x31, 0x01};
constexpr uint32_t kMultiPart = 0x1000;  // flag in the version field
constexpr size_t kLongestName = 255;

class HeaderCheck {
 public:
  explicit HeaderCheck(const std::string& path) : path_(path), file_(nullptr, &std::fclose) {
    std::error_code ignored;
    const bool regular = std::filesystem::is_regular_file(path, ignored);
    if (!regular && std::filesystem::exists(path, ignored)) {  // opening a named pipe could wait for ever
      const bool folder = std::filesystem::is_directory(path, ignored);
      throw Error(ErrorCode::kIo,
                  fmt::format("cannot read {}: {}", path, folder ? "it is a folder" : "not a regular file"));
    }
    file_.reset(std::fopen(path.c_str(), "rb"));
    if (!file_)
      throw Error(ErrorCode::kIo,
                  fmt::format("cannot read {}: {}", path.empty() ? "''" : path, std::strerror(errno)));
    left_ = std::filesystem::file_size(path, ignored);
  }

  /// The first bytes of the file; fewer where it is shorter.
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
    while (check_part()) {  // an empty header follows the last part
    }
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(ErrorCode::kInput, fmt::format("{}: damaged EXR file: {}", path_, what));
  }

  /// Checks the attributes of one part; false when there are none.
  bool check_part() {
    bool any = false;
    for (std::string name = text(); !name.empty(); name = text(), any = true) {
      const std::string type = text();
      const uint32_t size = whole_number();
      if (size > left_)
        fail(fmt::format("the attribute '{}' claims {} bytes; {} bytes of the file are left", name, size, left_));
      if (type == "stringvector" || type == "preview") {
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

  /// Values that hold sizes of their own.
  void check_value(const std::string& name, const std::string& type, const std::vector<char>& value) const {
    const auto number_at = [&](size_t at) {
      uint32_t number = 0;
      if (at + sizeof(number) > value.size()) fail(fmt::format("the attribute '{}' ends early", name));
      std::memcpy(&number, value.data() + at, sizeof(number));
      return number;
    };
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
  /// Up to the next zero byte.
  std::string text() {
    std::string result;
    while (const int c = byte()) {
      result += static_cast<char>(c);
      if (result.size() > kLongestName) fail(fmt::format("a name is longer than {} characters", kLongestName));
    }
    return result;
  }
  /// Little-endian, like every number of the format.
  uint32_t whole_number() {
    uint32_t number = 0;
    for (int shift = 0; shift < 32; shift += 8) number |= static_cast<uint32_t>(byte()) << shift;
    return number;
  }

  std::string path_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_;
  uint64_t left_ = 0;  // bytes behind the place of reading
};

}  // namespace

bool is_exr(const std::string& path) {
  const std::vector<unsigned char> magic = HeaderCheck(path).magic();
  return magic.size() == sizeof(kMagic) && std::memcmp(magic.data(), kMagic, sizeof(kMagic)) == 0;
}

void check_exr_header(const std::string& path) { HeaderCheck(path).check(); }

}  // namespace covary
