// SPDX-License-Identifier: Apache-2.0
#include "imageio/checksums.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <sstream>

#include "core/error.h"

namespace covary {
namespace {

constexpr const char* kPrefix = "covary:";
constexpr const char* kMethod = "crc32";
constexpr size_t kDigits = 8;

uint32_t crc_of_bytes(uint32_t crc, const void* bytes, size_t size) {
  return static_cast<uint32_t>(crc32_z(crc, static_cast<const Bytef*>(bytes), size));
}

std::optional<Checksums> parse(const std::string& text) {
  std::istringstream words(text);
  std::string word;
  if (!(words >> word) || word != kMethod) return std::nullopt;
  std::vector<uint32_t> numbers;
  while (words >> word) {
    uint32_t number = 0;
    const char* end = word.data() + word.size();
    const auto [stopped, error] = std::from_chars(word.data(), end, number, 16);
    if (word.size() != kDigits || error != std::errc() || stopped != end) return std::nullopt;
    numbers.push_back(number);
  }
  if (numbers.size() < 2) return std::nullopt;
  Checksums sums{numbers[0], {numbers.begin() + 1, numbers.end()}};
  if (sums.text() != text) return std::nullopt;  // upper-case digits: a flipped bit
  return sums;
}

}  // namespace

std::string Checksums::text() const {
  std::string text = fmt::format("{} {:08x}", kMethod, header);
  for (const uint32_t channel : channels) text += fmt::format(" {:08x}", channel);
  return text;
}

std::optional<Checksums> find_checksums(const std::string& path, const std::map<std::string, std::string>& attributes) {
  const auto it = attributes.find(kChecksums);
  if (it == attributes.end()) {
    // Damage may have changed the attribute's name.
    for (const auto& [name, value] : attributes)
      if (parse(value))
        throw Error(ErrorCode::kInput, fmt::format("{}: damaged: the attribute '{}' holds checksums, which the "
                                                   "attribute {} should",
                                                   path, name, kChecksums));
    return std::nullopt;
  }
  std::optional<Checksums> found = parse(it->second);
  if (!found)
    throw Error(ErrorCode::kInput, fmt::format("{}: damaged: the attribute {} is '{}'; expected '{}' and words of "
                                               "{} hexadecimal digits, one for the header and one for each channel",
                                               path, kChecksums, it->second, kMethod, kDigits));
  return found;
}

uint32_t crc_of_values(uint32_t crc, const void* first, size_t n, size_t stride) {
  constexpr size_t kSize = 4, kAtOnce = 1024;
  const auto* from = static_cast<const char*>(first);
  if (stride == kSize) return crc_of_bytes(crc, from, n * kSize);
  char gathered[kAtOnce * kSize];
  for (size_t done = 0; done < n;) {
    const size_t now = std::min(n - done, kAtOnce);
    for (size_t i = 0; i < now; ++i) std::copy_n(from + (done + i) * stride, kSize, gathered + i * kSize);
    crc = crc_of_bytes(crc, gathered, now * kSize);
    done += now;
  }
  return crc;
}

uint32_t crc_of_header(const std::string& shape, const std::map<std::string, std::string>& attributes) {
  std::string text = shape + "\n";
  for (const auto& [name, value] : attributes)
    if (name.starts_with(kPrefix) && name != kChecksums) text += fmt::format("{}={}\n", name, value);
  return crc_of_bytes(0, text.data(), text.size());
}

void fail_checksum(const std::string& path, const std::string& what, uint32_t found, uint32_t stored) {
  throw Error(
      ErrorCode::kInput,
      fmt::format("{}: {} with the checksum {:08x}, not {:08x} as the attribute {} says: the file is damaged, or "
                  "another program changed it ('covary convert --accept-changed' makes an image of a changed "
                  "one)",
                  path, what, found, stored, kChecksums));
}

}  // namespace covary
