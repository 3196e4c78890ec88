// SPDX-License-Identifier: Apache-2.0
#include "imageio/plain_rows.h"

#include <cstring>
#include <limits>
#include <vector>

#include "core/error.h"

namespace covary {
namespace {

template <typename From, typename To>
void convert(const uint8_t* from, To& to) {
  From value;
  std::memcpy(&value, from, sizeof(From));
  if constexpr (std::is_same_v<From, To>)
    to = value;
  else  // as OpenImageIO does
    to = static_cast<float>(value) * (1.0f / static_cast<float>(std::numeric_limits<From>::max()));
}

class PlainReader final : public ImageReader {
 public:
  PlainReader(const std::string& path, const char* format, OpenRows open) : open_(std::move(open)) {
    path_ = path;
    const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path.c_str(), "rb"), &std::fclose);
    if (!file) throw Error(ErrorCode::kIo, "cannot read " + path);
    const std::unique_ptr<PlainRows> rows = open_(file.get());
    header_.format = format;
    header_.width = header_.frame_width = rows->width;
    header_.height = header_.frame_height = rows->height;
    header_.floating_point = rows->bytes_per_value == sizeof(float);
    header_.type = header_.floating_point ? "float" : rows->bytes_per_value == 2 ? "uint16" : "uint8";
    header_.channels = rows->channels < 3 ? std::vector<std::string>{"Y"} : std::vector<std::string>{"R", "G", "B"};
    if (rows->channels % 2 == 0) {
      header_.alpha_channel = rows->channels - 1, header_.straight_alpha = true;  // of the formats here, PNG alone
      header_.channels.emplace_back("A");
    }
  }

 private:
  bool read(const Part& part, float* values, std::string& problem) override {
    if (header_.floating_point) return read_as<float>(part, values, problem);
    return header_.type == "uint16" ? read_as<uint16_t>(part, values, problem)
                                    : read_as<uint8_t>(part, values, problem);
  }
  bool read(const Part& part, uint8_t* values, std::string& problem) override {
    if (header_.type == "uint8") return read_as<uint8_t>(part, values, problem);
    problem = "its values are no bytes";
    return false;
  }

  /// Reads the whole image; opens the file again.
  template <typename From, typename To>
  bool read_as(const Part& part, To* values, std::string& problem) {
    try {
      const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen(path_.c_str(), "rb"), &std::fclose);
      if (!file) throw Error(ErrorCode::kIo, "it cannot be opened again");
      const std::unique_ptr<PlainRows> rows = open_(file.get());
      if (rows->width != header_.width || rows->height != header_.height || rows->bytes_per_value != sizeof(From) ||
          rows->channels != static_cast<int>(header_.channels.size()))
        throw Error(ErrorCode::kInput, "it has changed");
      const size_t channels = header_.channels.size();
      std::vector<uint8_t> row(sizeof(From) * channels * static_cast<size_t>(header_.width));
      for (int y = 0; y < header_.height; ++y) {
        rows->read_row(row.data());
        for (size_t x = 0; x < static_cast<size_t>(header_.width); ++x)
          for (int c = part.first; c < part.last; ++c)
            convert<From>(&row[sizeof(From) * (x * channels + static_cast<size_t>(c))], *values++);
      }
      return true;
    } catch (const std::exception& error) {
      problem = error.what();
      return false;
    }
  }

  OpenRows open_;
};

}  // namespace

std::unique_ptr<ImageReader> open_plain_rows(const std::string& path, const char* format, OpenRows open) {
  try {
    return std::make_unique<PlainReader>(path, format, std::move(open));
  } catch (const Error&) {
    return nullptr;
  }
}

}  // namespace covary
