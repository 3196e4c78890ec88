// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace covary {

/// XXH64 (seed 0) of the bytes: fast and well mixed, not cryptographic. Films store it for their scene.
uint64_t hash_bytes(std::span<const std::byte> bytes);
inline uint64_t hash_bytes(std::string_view text) { return hash_bytes(std::as_bytes(std::span(text))); }

/// 16 lower-case hexadecimal digits.
std::string hash_text(uint64_t hash);

/// XXH3-128 (seed 0) of the text as 32 lower-case hexadecimal digits. The chance of two texts sharing a key is
/// negligible (10^-21 for 10^9 keys).
std::string key_text(std::string_view text);

}  // namespace covary
