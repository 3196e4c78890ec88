// SPDX-License-Identifier: Apache-2.0
// Checksums in the EXR files that covary writes (docs/file-formats.md): one of the header and one per channel, so that
// a reader of some channels can verify just those.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace covary {

/// Name of the attribute. Its value: "crc32", then 8 hexadecimal digits for the header and for each channel, in order
/// of channel names.
inline constexpr const char* kChecksums = "covary:checksums";

struct Checksums {
  uint32_t header = 0;
  std::vector<uint32_t> channels;

  std::string text() const;
};

/// The checksums among the attributes; nullopt if the file has none. Throws Error(kInput) naming the file if they
/// cannot be parsed: a damaged file must not pass for one without checksums.
std::optional<Checksums> find_checksums(const std::string& path, const std::map<std::string, std::string>& attributes);

/// Updates `crc` (0 to start) with `n` values of 4 bytes, `stride` bytes apart.
uint32_t crc_of_values(uint32_t crc, const void* first, size_t n, size_t stride);

/// CRC-32 of the header: `shape` (windows and channels) and covary's attributes except the checksums themselves.
uint32_t crc_of_header(const std::string& shape, const std::map<std::string, std::string>& attributes);

/// Throws Error(kInput): "`path`: `what` …" does not match its checksum.
[[noreturn]] void fail_checksum(const std::string& path, const std::string& what, uint32_t found, uint32_t stored);

}  // namespace covary
