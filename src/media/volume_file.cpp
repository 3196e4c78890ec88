// SPDX-License-Identifier: Apache-2.0
#include "media/volume_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "core/error.h"
#include "core/memory_limit.h"

namespace covary {
namespace {

static_assert(std::endian::native == std::endian::little, "files are read as they lie in memory");

constexpr size_t kHeaderBytes = 48;
constexpr int kMaxCells = 1 << 20;  // along one axis

template <typename T>
T at(const char* header, size_t place) {
  T value;
  std::memcpy(&value, header + place, sizeof(T));
  return value;
}

/// Parses the header, not the values.
VolumeFile parse_header(const std::string& path, const char* header, size_t n_bytes) {
  const auto refuse = [&](const std::string& what) { return Error(ErrorCode::kInput, path + ": " + what); };
  if (n_bytes < kHeaderBytes || std::memcmp(header, "VOL", 3) != 0)
    throw refuse("is not a volume file: expected a header of 48 bytes that begins with 'VOL'");
  if (const int version = at<uint8_t>(header, 3); version != 3)
    throw refuse(fmt::format("is a volume file of version {}; expected 3", version));
  if (const int encoding = at<int32_t>(header, 4); encoding != 1)
    throw refuse(fmt::format("holds values of encoding {}; expected 1, 32-bit floats", encoding));
  VolumeFile file;
  for (size_t axis = 0; axis < 3; ++axis) {
    file.size[axis] = at<int32_t>(header, 8 + 4 * axis);
    if (file.size[axis] < 1 || file.size[axis] > kMaxCells)
      throw refuse(fmt::format("has {} cells along {}; expected 1 to {}", file.size[axis], "xyz"[axis], kMaxCells));
  }
  file.channels = at<int32_t>(header, 20);
  if (file.channels != 1 && file.channels != 3)
    throw refuse(fmt::format("has {} channels; expected 1 or 3", file.channels));
  for (int axis = 0; axis < 3; ++axis) {
    file.bounds.lower[axis] = at<float>(header, 24 + 4 * static_cast<size_t>(axis));
    file.bounds.upper[axis] = at<float>(header, 36 + 4 * static_cast<size_t>(axis));
  }
  return file;
}

/// Allocates `values` if the header's sizes fit the number of bytes.
void allocate(const std::string& path, VolumeFile& file, double n_bytes) {
  const double n = 1.0 * file.size[0] * file.size[1] * file.size[2] * file.channels;
  if (n_bytes != kHeaderBytes + 4 * n)
    throw Error(ErrorCode::kInput,
                fmt::format("{}: has {} bytes; a grid of {} x {} x {} cells with {} channels has {:.0f}", path, n_bytes,
                            file.size[0], file.size[1], file.size[2], file.channels, kHeaderBytes + 4 * n));
  require_memory(path, fmt::format("a grid of {} x {} x {} cells", file.size[0], file.size[1], file.size[2]), 4 * n);
  file.values.resize(static_cast<size_t>(n));
}

void check_values(const std::string& path, const VolumeFile& file) {
  const auto wrong = std::find_if(file.values.begin(), file.values.end(), [](float v) { return !std::isfinite(v); });
  if (wrong != file.values.end())
    throw Error(ErrorCode::kInput, fmt::format("{}: value {} is not finite", path, wrong - file.values.begin()));
}

}  // namespace

VolumeFile parse_volume(const std::string& where, std::string_view bytes) {
  VolumeFile file = parse_header(where, bytes.data(), bytes.size());
  allocate(where, file, static_cast<double>(bytes.size()));
  std::memcpy(file.values.data(), bytes.data() + kHeaderBytes, 4 * file.values.size());
  check_values(where, file);
  return file;
}

VolumeFile read_volume_file(const std::string& path) {
  std::error_code failed;
  const uint64_t n_bytes = std::filesystem::file_size(path, failed);
  std::ifstream stream(path, std::ios::binary);
  if (failed || !stream) throw Error(ErrorCode::kIo, path + ": cannot be read");
  char header[kHeaderBytes] = {};
  stream.read(header, kHeaderBytes);
  VolumeFile file = parse_header(path, header, static_cast<size_t>(stream.gcount()));
  allocate(path, file, static_cast<double>(n_bytes));
  stream.read(reinterpret_cast<char*>(file.values.data()), static_cast<std::streamsize>(4 * file.values.size()));
  if (!stream) throw Error(ErrorCode::kIo, path + ": cannot be read");
  check_values(path, file);
  return file;
}

}  // namespace covary
