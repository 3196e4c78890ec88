// SPDX-License-Identifier: Apache-2.0
#include "textures/embedded_image.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>

#include "core/error.h"

namespace covary {
namespace {

[[noreturn]] void fail() { throw Error(ErrorCode::kInput, "the embedded image is no PGM, PPM or PFM file"); }

/// The header's next word; one blank behind it is taken, too.
std::string_view take_word(std::string_view& bytes) {
  const size_t end = std::min(bytes.find_first_of(" \n"), bytes.size());
  const std::string_view word = bytes.substr(0, end);
  bytes.remove_prefix(std::min(end + 1, bytes.size()));
  return word;
}

int take_size(std::string_view& bytes) {
  const std::string_view word = take_word(bytes);
  int value = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (error != std::errc() || end != word.data() + word.size() || value < 1 || value > 65536) fail();
  return value;
}

}  // namespace

TexelImage read_embedded_image(std::string_view bytes) {
  const std::string_view kind = take_word(bytes);
  const bool floats = kind == "PF" || kind == "Pf", grey = kind == "P5" || kind == "Pf";
  if (!floats && kind != "P5" && kind != "P6") fail();
  TexelImage image;
  image.width = take_size(bytes), image.height = take_size(bytes);
  image.channels = grey ? 1 : 3;
  image.srgb = !floats;
  if (take_word(bytes) != (floats ? "-1.0" : "255")) fail();
  const size_t row = static_cast<size_t>(image.width) * image.channels, n = row * image.height;
  if (bytes.size() != n * (floats ? sizeof(float) : 1)) fail();
  if (!floats) {
    image.bytes.assign(bytes.begin(), bytes.end());
    return image;
  }
  image.floats.resize(n);
  for (size_t y = 0; y < static_cast<size_t>(image.height); ++y)  // rows from the lowest up
    std::memcpy(&image.floats[y * row], bytes.data() + (image.height - 1 - y) * row * sizeof(float),
                row * sizeof(float));
  if (!std::all_of(image.floats.begin(), image.floats.end(), [](float x) { return std::isfinite(x); })) fail();
  return image;
}

}  // namespace covary
