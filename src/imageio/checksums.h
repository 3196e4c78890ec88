// SPDX-License-Identifier: Apache-2.0
// Checksums in EXR files that covary writes (docs/file-formats.md): one of what the header says, one of each channel,
// so that whoever reads some channels checks these.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace covary {

/// Attribute: "crc32" and a word of 8 hexadecimal digits for the header, and for each channel in the order of names.
inline constexpr const char* kChecksums = "covary:checksums";

struct Checksums {
  uint32_t header = 0;
  std::vector<uint32_t> channels;

  std::string text() const;
};

/// Those of the attributes; none where the file has none. Throws Error(kInput) with the file's name where they cannot
/// be read: one that was damaged must not pass as one without.
std::optional<Checksums> find_checksums(const std::string& path, const std::map<std::string, std::string>& attributes);

/// CRC-32 continued by `n` values of 4 bytes, `stride` bytes from one to the next; of nothing it is 0.
uint32_t crc_of_values(uint32_t crc, const void* first, size_t n, size_t stride);

/// CRC-32 of what the header says: `shape` (windows and channels) and the attributes of covary, these checksums left
/// out.
uint32_t crc_of_header(const std::string& shape, const std::map<std::string, std::string>& attributes);

/// Throws Error(kInput): "`path`: `what` …" does not fit its checksum.
[[noreturn]] void fail_checksum(const std::string& path, const std::string& what, uint32_t found, uint32_t stored);

}  // namespace covary
