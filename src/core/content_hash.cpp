// SPDX-License-Identifier: Apache-2.0
#include "core/content_hash.h"

#include <fmt/format.h>
#include <xxhash.h>

namespace covary {

uint64_t hash_bytes(std::span<const std::byte> bytes) { return XXH64(bytes.data(), bytes.size(), 0); }

std::string hash_text(uint64_t hash) { return fmt::format("{:016x}", hash); }

std::string key_text(std::string_view text) {
  const XXH128_hash_t hash = XXH3_128bits(text.data(), text.size());
  return hash_text(hash.high64) + hash_text(hash.low64);
}

}  // namespace covary
