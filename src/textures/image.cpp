// SPDX-License-Identifier: Apache-2.0
#include "textures/image.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <memory>
#include <optional>

#include "core/error.h"
#include "core/memory_limit.h"
#include "core/srgb.h"
#include "imageio/checksums.h"
#include "imageio/image_io.h"

namespace covary {
namespace {

/// Indices of the channels that hold grey or red, green, blue.
std::vector<int> choose_channels(const ImageHeader& header, const std::string& path) {
  if (header.n_picture == 1) return {0};
  if (header.n_picture == 3) return {0, 1, 2};
  const std::vector<std::string>& names = header.channels;
  const auto find = [&](const char* name) {
    const auto it = std::find_if(names.begin(), names.end(),
                                 [&](const std::string& n) { return strcasecmp(n.c_str(), name) == 0; });
    return it == names.end() ? -1 : static_cast<int>(it - names.begin());
  };
  const std::array<int, 3> rgb = {find("R"), find("G"), find("B")};
  if (std::all_of(rgb.begin(), rgb.end(), [](int c) { return c >= 0; })) return {rgb.begin(), rgb.end()};
  if (names.size() <= 2 && header.alpha_channel != 0) return {0};
  if (find("Y") >= 0 && find("RY") < 0 && find("BY") < 0 && find("X") < 0) return {find("Y")};
  throw Error(ErrorCode::kInput, fmt::format("{} has the channels {}; a texture needs R, G, B or a grey one", path,
                                             fmt::join(names, ", ")));
}

/// Selects channels `keep` from pixels whose channels start at `first`.
template <typename T>
std::vector<T> keep_channels(std::vector<T> all, size_t n_pixels, int first, const std::vector<int>& keep) {
  const size_t n_read = all.size() / n_pixels;
  if (n_read == keep.size() && std::is_sorted(keep.begin(), keep.end())) return all;
  std::vector<T> kept(n_pixels * keep.size());
  for (size_t i = 0; i < n_pixels; ++i)
    for (size_t c = 0; c < keep.size(); ++c) kept[i * keep.size() + c] = all[i * n_read + keep[c] - first];
  return kept;
}

/// Throws if a value is not finite.
void check_finite(const TexelImage& image, const std::string& path) {
  const auto it = std::find_if(image.floats.begin(), image.floats.end(), [](float v) { return !std::isfinite(v); });
  if (it == image.floats.end()) return;
  const size_t pixel = static_cast<size_t>(it - image.floats.begin()) / image.channels;
  throw Error(ErrorCode::kInput, fmt::format("{} holds the value {} at pixel ({}, {}); all must be finite", path, *it,
                                             pixel % image.width, pixel / image.width));
}

/// Throws if an EXR file of covary does not match its checksums.
void check_checksums(const TexelImage& image, const ImageHeader& header, const std::vector<int>& channels,
                     const std::string& path) {
  if (header.format != "openexr" || header.type != "float") return;
  const std::optional<Checksums> stored = find_checksums(path, header.attributes);
  if (!stored || stored->channels.size() != header.channels.size()) return;
  for (size_t c = 0; c < channels.size(); ++c) {
    const std::string& name = header.channels[channels[c]];
    // Channels are sorted by name in the file; OpenImageIO puts colours first.
    const auto place = std::count_if(header.channels.begin(), header.channels.end(),
                                     [&](const std::string& other) { return other < name; });
    const uint32_t crc = crc_of_values(0, image.floats.data() + c, image.n_pixels(), channels.size() * sizeof(float));
    if (crc != stored->channels[place])
      fail_checksum(path, fmt::format("the channel {} is one", name), crc, stored->channels[place]);
  }
}

/// Bytes per texel with all channels of the file, and with those that are kept.
struct TexelBytes {
  double read, kept;
};

/// Peak memory per pixel of one use of the texels.
using BytesPerPixel = double (*)(const TexelBytes&, bool bytes_of_colours);

/// The texels and their copy in blocks; byte colours are padded to 32 bits there.
double bytes_of_texture(const TexelBytes& texel, bool bytes_of_colours) {
  return texel.read + std::max(texel.read == texel.kept ? 0 : texel.kept,
                               bytes_of_colours ? static_cast<double>(sizeof(uint32_t)) : texel.kept);
}

/// First the texels and the linear image; then that image, its texels as four floats each, and their tables.
double bytes_of_environment(const TexelBytes& texel, bool) {
  constexpr double kLinear = 3 * sizeof(float), kTexel = 4 * sizeof(float), kTables = 2;
  return std::max(texel.read + kLinear, kLinear + kTexel + kTables);
}

TexelImage read(const std::string& path, BytesPerPixel bytes_per_pixel) {
  const std::unique_ptr<ImageReader> file = open_image(path, OtherColours::kKeep);
  const ImageHeader& header = file->header();
  const std::vector<int> channels = choose_channels(header, path);
  const auto [first, last] = std::minmax_element(channels.begin(), channels.end());
  TexelImage image;
  image.width = header.width, image.height = header.height, image.channels = static_cast<int>(channels.size());
  image.srgb = !header.floating_point;
  const bool is_bytes = header.type == "uint8";
  const double value = is_bytes ? 1 : sizeof(float);
  require_memory(
      path, fmt::format("a texture of {} x {} pixels", header.width, header.height),
      bytes_per_pixel({(*last - *first + 1) * value, image.channels * value}, is_bytes && image.channels == 3) *
          static_cast<double>(image.n_pixels()));
  if (is_bytes)
    image.bytes = keep_channels(file->read_bytes(*first, *last + 1), image.n_pixels(), *first, channels);
  else
    image.floats = keep_channels(file->read_floats(*first, *last + 1), image.n_pixels(), *first, channels);
  check_checksums(image, header, channels, path);
  check_finite(image, path);
  return image;
}

}  // namespace

TexelImage read_texels(const std::string& path) { return read(path, bytes_of_texture); }

TexelImage read_alpha_or_mean(const std::string& path, bool raw) {
  {
    const std::unique_ptr<ImageReader> file = open_image(path, OtherColours::kKeep);
    const ImageHeader& header = file->header();
    if (const int alpha = header.alpha_channel; alpha >= 0 && header.channels.size() > 3) {
      TexelImage image;
      image.width = header.width, image.height = header.height, image.channels = 1;
      image.srgb = !header.floating_point;
      require_memory(path, fmt::format("the alpha of {} x {} pixels", header.width, header.height),
                     sizeof(float) * static_cast<double>(image.n_pixels()));
      image.floats = file->read_floats(alpha, alpha + 1);
      check_finite(image, path);
      if (std::any_of(image.floats.begin(), image.floats.end(), [](float a) { return a != 1; })) return image;
    }
  }
  TexelImage image = read_texels(path);
  if (image.channels == 1) return image;
  std::vector<float> means(image.n_pixels());
  for (size_t i = 0; i < 3 * means.size(); ++i) {
    const float value = image.bytes.empty() ? image.floats[i] : static_cast<float>(image.bytes[i]) / 255;
    means[i / 3] += (image.srgb && !raw ? srgb_to_linear(value) : value) / 3;
  }
  image.channels = 1, image.bytes.clear(), image.floats = std::move(means), image.srgb = false;
  return image;
}

TexelImage read_linear_rgb(const std::string& path) {
  const TexelImage source = read(path, bytes_of_environment);
  const size_t n_values = source.n_pixels() * source.channels;
  TexelImage result;
  result.width = source.width, result.height = source.height, result.channels = 3;
  result.floats.resize(source.n_pixels() * 3);
  for (size_t i = 0; i < n_values; ++i) {
    float value = source.bytes.empty() ? source.floats[i] : static_cast<float>(source.bytes[i]) / 255;
    if (source.srgb) value = srgb_to_linear(value);
    if (source.channels == 3)
      result.floats[i] = value;
    else
      for (int c = 0; c < 3; ++c) result.floats[3 * i + c] = value;
  }
  return result;
}

namespace {

[[noreturn]] void fail() { throw Error(ErrorCode::kInput, "the embedded image is not a PGM, PPM or PFM file"); }

/// The next word of the header; also consumes one white-space character after it.
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
  for (size_t y = 0; y < static_cast<size_t>(image.height); ++y)  // rows from bottom to top
    std::memcpy(&image.floats[y * row], bytes.data() + (image.height - 1 - y) * row * sizeof(float),
                row * sizeof(float));
  if (!std::all_of(image.floats.begin(), image.floats.end(), [](float x) { return std::isfinite(x); })) fail();
  return image;
}

}  // namespace covary
