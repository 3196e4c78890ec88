// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

namespace covary::test_support {

/// The bytes of a Mitsuba volume file with nx x ny x nz cells over the box [-1, 1]³.
inline std::string volume_text(int nx, int ny, int nz, int channels, const std::vector<float>& values) {
  std::string text = "VOL\x03";
  const auto append = [&](const auto& value) { text.append(reinterpret_cast<const char*>(&value), sizeof(value)); };
  for (const int32_t number : {1, nx, ny, nz, channels}) append(number);
  for (const float side : {-1.0f, -1.0f, -1.0f, 1.0f, 1.0f, 1.0f}) append(side);
  for (const float value : values) append(value);
  return text;
}

}  // namespace covary::test_support
