// SPDX-License-Identifier: Apache-2.0
#include "imageio/plain_rows.h"

#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "core/error.h"

namespace covary {
namespace {

constexpr size_t kLine = 256;  // files with longer header lines are left to OpenImageIO
constexpr int kMaxLines = 100;
constexpr int kNarrow = 8;  // narrower rows are not run-length encoded

[[noreturn]] void fail(const char* why) { throw Error(ErrorCode::kInput, why); }

/// Rows are stored as all reds, then greens, blues and exponents, run-length encoded; narrow rows as plain RGBE pixels.
class HdrRows final : public PlainRows {
 public:
  explicit HdrRows(std::FILE* file) : file_(file) {
    if (const std::string first = line(); first != "#?RADIANCE" && first != "#?RGBE") fail("it is not an HDR file");
    bool has_format = false;
    for (int i = 0; i < kMaxLines; ++i) {
      const std::string text = line();
      if (text.empty()) break;
      has_format |= text == "FORMAT=32-bit_rle_rgbe";
    }
    std::array<char, 2> rest{};
    const bool has_size = std::sscanf(line().c_str(), "-Y %d +X %d%1s", &height, &width, rest.data()) == 2;
    if (!has_format || !has_size || width < 1 || width > 32767 || height < 1) fail("it is an unusual HDR file");
    channels = 3, bytes_per_value = sizeof(float);
    packed_.resize(size_t{4} * static_cast<size_t>(width));
  }

  void read_row(uint8_t* row) override {
    width < kNarrow ? read_flat() : read_runs();
    const auto of = [&](int c, int x) { return packed_[static_cast<size_t>(c) * width + x]; };
    for (int x = 0; x < width; ++x) {
      const float scale = of(3, x) == 0 ? 0 : std::ldexp(1.0f, of(3, x) - (128 + 8));
      for (int c = 0; c < 3; ++c, row += sizeof(float)) {
        const float value = static_cast<float>(of(c, x)) * scale;
        std::memcpy(row, &value, sizeof(value));
      }
    }
  }

 private:
  void read_flat() {
    for (int x = 0; x < width; ++x)
      for (int c = 0; c < 4; ++c) packed_[static_cast<size_t>(c) * width + x] = static_cast<uint8_t>(byte());
  }
  void read_runs() {
    if (byte() != 2 || byte() != 2 || (byte() << 8 | byte()) != width) fail("its rows are not packed by runs");
    for (size_t at = 0; at < packed_.size();) {
      const size_t end = (at / static_cast<size_t>(width) + 1) * static_cast<size_t>(width);
      const int count = byte(), n = count > 128 ? count - 128 : count;
      if (n == 0 || at + static_cast<size_t>(n) > end) fail("a run of its pixels is too long");
      const int repeated = count > 128 ? byte() : -1;
      for (int i = 0; i < n; ++i) packed_[at++] = static_cast<uint8_t>(repeated >= 0 ? repeated : byte());
    }
  }
  std::string line() {
    std::array<char, kLine> text{};
    if (!std::fgets(text.data(), kLine, file_)) fail("its header ends early");
    std::string result = text.data();
    if (result.empty() || result.back() != '\n') fail("its header has a long line");
    result.pop_back();
    return result;
  }
  int byte() {
    const int value = std::getc(file_);
    if (value == EOF) fail("it ends early");
    return value;
  }

  std::FILE* file_;
  std::vector<uint8_t> packed_;
};

}  // namespace

std::unique_ptr<ImageReader> open_plain_hdr(const std::string& path) {
  return open_plain_rows(path, "hdr", [](std::FILE* file) { return std::make_unique<HdrRows>(file); });
}

}  // namespace covary
