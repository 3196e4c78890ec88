// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace covary {

/// XXH64 (Y. Collet, seed 0) of the bytes: fast and well mixed, not cryptographic.
uint64_t hash_bytes(std::span<const std::byte> bytes);
inline uint64_t hash_bytes(std::string_view text) { return hash_bytes(std::as_bytes(std::span(text))); }

/// 16 lower-case hexadecimal digits.
std::string hash_text(uint64_t hash);

}  // namespace covary
