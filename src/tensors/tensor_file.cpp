// SPDX-License-Identifier: Apache-2.0
#include "tensors/tensor_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <span>

#include "core/error.h"

namespace covary {
namespace {

static_assert(std::endian::native == std::endian::little, "files are read as they lie in memory");

constexpr char kMagic[12] = "tensor_file";
constexpr int kByte = 1, kFloat = 10;
/// Bytes per value by type: unsigned and signed integers of 8 to 64 bits, floats of 16, 32, 64 bits.
constexpr size_t kSizes[] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};

Error refusal(const std::string& path, const std::string& what) { return {ErrorCode::kInput, path + ": " + what}; }

/// Reads the list of fields; a truncated list is an error.
class HeaderReader {
 public:
  HeaderReader(std::ifstream& stream, const std::string& path) : stream_(stream), path_(path) {}
  template <typename T>
  T number() {
    T value;
    read(&value, sizeof(T));
    return value;
  }
  std::string text(size_t length) {
    std::string result(length, '\0');
    read(result.data(), length);
    return result;
  }

 private:
  void read(void* to, size_t n) {
    stream_.read(static_cast<char*>(to), static_cast<std::streamsize>(n));
    if (!stream_) throw refusal(path_, "ends within the list of its fields");
  }
  std::ifstream& stream_;
  const std::string& path_;
};

}  // namespace

std::string shape_text(const std::vector<uint64_t>& shape) { return fmt::format("[{}]", fmt::join(shape, ", ")); }

TensorFile::TensorFile(const std::string& path) : path_(path) {
  std::error_code failed;
  n_bytes_ = std::filesystem::file_size(path, failed);
  std::ifstream stream(path, std::ios::binary);
  if (failed || !stream) throw Error(ErrorCode::kIo, path + ": cannot be read");
  char magic[sizeof(kMagic)] = {};
  stream.read(magic, sizeof(magic));
  if (!stream || std::memcmp(magic, kMagic, sizeof(magic)) != 0)
    throw refusal(path, "is not a tensor file: expected one that begins with 'tensor_file'");
  HeaderReader header(stream, path);
  const int major = header.number<uint8_t>(), minor = header.number<uint8_t>();
  if (major != 1 || minor != 0)
    throw refusal(path, fmt::format("is a tensor file of version {}.{}; expected 1.0", major, minor));
  const auto n_fields = header.number<uint32_t>();
  for (uint32_t i = 0; i < n_fields; ++i) {
    const std::string name = header.text(header.number<uint16_t>());
    const auto n_dimensions = header.number<uint16_t>();
    Field field;
    field.type = header.number<uint8_t>();
    field.place = header.number<uint64_t>();
    if (field.type == 0 || field.type >= static_cast<int>(std::size(kSizes)))
      throw refusal(path, fmt::format("has values of unknown type {} in field {}", field.type, i + 1));
    const uint64_t most = n_bytes_ / kSizes[field.type];  // as many values as fit in the file
    bool fits = field.place <= n_bytes_;
    field.count = 1;
    for (int d = 0; d < n_dimensions; ++d) {
      const auto length = field.shape.emplace_back(header.number<uint64_t>());
      fits = fits && (length == 0 || field.count <= most / length);
      field.count = fits ? field.count * length : 0;
    }
    if (!fits || field.count * kSizes[field.type] > n_bytes_ - field.place)
      throw refusal(path, fmt::format("has {} bytes, but its field {} says it has {} values at byte {}", n_bytes_,
                                      i + 1, shape_text(field.shape), field.place));
    if (!fields_.emplace(name, std::move(field)).second)
      throw refusal(path, fmt::format("has two fields of one name, the second is field {}", i + 1));
  }
}

const TensorFile::Field& TensorFile::find(const std::string& field) const {
  const auto found = fields_.find(field);
  if (found == fields_.end()) throw refusal(path_, "has no field '" + field + "'");
  return found->second;
}

void TensorFile::read_values(const std::string& name, int type, size_t size, void* to) const {
  const Field& field = find(name);
  if (field.type != type)
    throw refusal(path_, fmt::format("has values of type {} in field '{}'; expected {}", field.type, name,
                                     type == kFloat ? "10, 32-bit floats" : "1, bytes"));
  std::ifstream stream(path_, std::ios::binary);
  stream.seekg(static_cast<std::streamoff>(field.place));
  stream.read(static_cast<char*>(to), static_cast<std::streamsize>(field.count * size));
  if (!stream) throw Error(ErrorCode::kIo, path_ + ": cannot be read");
}

std::vector<float> TensorFile::floats(const std::string& field) const {
  std::vector<float> values(find(field).count);
  read_values(field, kFloat, sizeof(float), values.data());
  const auto wrong = std::ranges::find_if(values, [](float v) { return !std::isfinite(v); });
  if (wrong != values.end())
    throw refusal(path_, fmt::format("value {} of field '{}' is not finite", wrong - values.begin(), field));
  return values;
}

std::vector<uint8_t> TensorFile::bytes(const std::string& field) const {
  std::vector<uint8_t> values(find(field).count);
  read_values(field, kByte, 1, values.data());
  return values;
}

}  // namespace covary
