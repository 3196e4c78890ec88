// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace covary::test_support {

/// Bytes of a base64 text without line breaks (RFC 4648, section 4).
inline std::string decode_base64(std::string_view text) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned buffer = 0;
  int n_bits = 0;
  for (const char c : text) {
    const size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) break;  // padding
    buffer = buffer << 6 | static_cast<unsigned>(digit), n_bits += 6;
    if (n_bits >= 8) bytes += static_cast<char>(buffer >> (n_bits -= 8) & 255);
  }
  return bytes;
}

}  // namespace covary::test_support
