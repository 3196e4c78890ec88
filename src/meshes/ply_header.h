// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

enum class PlyType : uint8_t { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kInt64, kUint64, kFloat32, kFloat64 };
inline size_t size_of(PlyType type) {
  constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4, 8, 8, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

/// What a vertex property holds; kSkip: unused.
enum PlySlot : int8_t { kX, kY, kZ, kNx, kNy, kNz, kU, kV, kR, kG, kB, kTx, kTy, kTz, kTw, kSlots, kSkip = -1 };

struct PlyProperty {
  std::string name;
  PlyType type = PlyType::kFloat32;
  bool is_list = false;
  PlyType count_type = PlyType::kUint8;
  PlySlot slot = kSkip;
  int attribute = -1, channel = 0;  ///< index of the mesh attribute that this is a channel of; -1: none
};

struct PlyElement {
  std::string name;
  uint64_t count = 0;
  std::vector<PlyProperty> properties;

  bool has_lists() const {
    for (const PlyProperty& p : properties)
      if (p.is_list) return true;
    return false;
  }
  /// Size of a record in bytes with all lists empty.
  size_t smallest_record() const {
    size_t size = 0;
    for (const PlyProperty& p : properties) size += size_of(p.is_list ? p.count_type : p.type);
    return size;
  }
};

enum class PlyFormat { kAscii, kLittleEndian, kBigEndian };

struct PlyHeader {
  PlyFormat format = PlyFormat::kAscii;
  std::vector<PlyElement> elements;
  size_t size = 0;  ///< bytes before the body
};

/// Throws Error(kInput) naming the line.
PlyHeader parse_ply_header(std::string_view text);
/// Throws Error(kInput) with the prefix of PLY errors.
[[noreturn]] void fail_ply(const std::string& message);

}  // namespace covary
