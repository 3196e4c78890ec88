// SPDX-License-Identifier: Apache-2.0
#include "textures/image.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>

#include "core/error.h"
#include "core/srgb.h"

namespace covary {
namespace {

constexpr size_t kMaxPixels = size_t{1} << 30;
/// No format packs an image tighter than this many bytes of pixels into one byte of file (deflate: about 1032).
constexpr size_t kMaxCompression = 10000;

/// Which channels of the file hold grey or red, green, blue.
std::vector<int> choose_channels(const OIIO::ImageSpec& spec, const std::string& path) {
  const auto find = [&](const char* name) {
    const auto& names = spec.channelnames;
    const auto it =
        std::find_if(names.begin(), names.end(), [&](const std::string& n) { return OIIO::Strutil::iequals(n, name); });
    return it == names.end() ? -1 : static_cast<int>(it - names.begin());
  };
  const std::array<int, 3> rgb = {find("R"), find("G"), find("B")};
  if (std::all_of(rgb.begin(), rgb.end(), [](int c) { return c >= 0; })) return {rgb.begin(), rgb.end()};
  if (spec.nchannels <= 2 && spec.alpha_channel != 0) return {0};
  if (find("Y") >= 0 && find("RY") < 0 && find("BY") < 0 && find("X") < 0) return {find("Y")};
  throw Error(ErrorCode::kInput, fmt::format("image '{}' has the channels {}; a texture needs R, G, B or a grey one",
                                             path, fmt::join(spec.channelnames, ", ")));
}

void check_size(const OIIO::ImageSpec& spec, const std::string& path) {
  if (spec.width < 1 || spec.height < 1 || spec.nchannels < 1)
    throw Error(ErrorCode::kInput, fmt::format("image '{}' is empty: {} x {} pixels, {} channels", path, spec.width,
                                               spec.height, spec.nchannels));
  if (spec.depth > 1)
    throw Error(ErrorCode::kInput, fmt::format("image '{}' is a volume of depth {}, not a picture", path, spec.depth));
  std::error_code ignored;
  const size_t file_bytes = std::filesystem::file_size(path, ignored);
  const size_t n_pixels = static_cast<size_t>(spec.width) * spec.height;
  if (n_pixels > kMaxPixels || n_pixels / kMaxCompression > file_bytes)
    throw Error(ErrorCode::kInput, fmt::format("image '{}' claims {} x {} pixels in {} bytes; at most {} pixels are "
                                               "accepted, and {} per byte of the file",
                                               path, spec.width, spec.height, file_bytes, kMaxPixels, kMaxCompression));
}

/// Reads all pixels and keeps the channels in `keep`.
template <typename T>
std::vector<T> read_channels(OIIO::ImageInput& input, const OIIO::ImageSpec& spec, const std::vector<int>& keep,
                             OIIO::TypeDesc type, const std::string& path) {
  const int first = *std::min_element(keep.begin(), keep.end());
  const int last = *std::max_element(keep.begin(), keep.end()) + 1;
  const size_t n_read = last - first, n_pixels = static_cast<size_t>(spec.width) * spec.height;
  std::vector<T> all(n_pixels * n_read);
  if (!input.read_image(0, 0, first, last, type, all.data()))
    throw Error(ErrorCode::kInput, fmt::format("image '{}' is broken: {}", path, input.geterror()));
  if (n_read == keep.size() && std::is_sorted(keep.begin(), keep.end())) return all;
  std::vector<T> kept(n_pixels * keep.size());
  for (size_t i = 0; i < n_pixels; ++i)
    for (size_t c = 0; c < keep.size(); ++c) kept[i * keep.size() + c] = all[i * n_read + keep[c] - first];
  return kept;
}

}  // namespace

TexelImage read_texels(const std::string& path) {
  OIIO::ImageSpec config;
  config.attribute("oiio:UnassociatedAlpha", 1);  // do not multiply colours by alpha
  config.attribute("oiio:RawColor", 1);
  std::error_code status;
  if (!std::filesystem::is_regular_file(path, status))
    throw Error(ErrorCode::kIo, fmt::format("cannot open image '{}': not a file", path));
  const auto input = OIIO::ImageInput::open(path, &config);
  if (!input) throw Error(ErrorCode::kInput, fmt::format("cannot read image '{}': {}", path, OIIO::geterror()));
  const OIIO::ImageSpec spec = input->spec();
  check_size(spec, path);

  const std::vector<int> channels = choose_channels(spec, path);
  TexelImage image;
  image.width = spec.width, image.height = spec.height, image.channels = static_cast<int>(channels.size());
  image.srgb = !spec.format.is_floating_point();
  if (spec.format == OIIO::TypeDesc::UINT8)
    image.bytes = read_channels<uint8_t>(*input, spec, channels, OIIO::TypeDesc::UINT8, path);
  else
    image.floats = read_channels<float>(*input, spec, channels, OIIO::TypeDesc::FLOAT, path);
  return image;
}

TexelImage read_linear_rgb(const std::string& path) {
  const TexelImage source = read_texels(path);
  const size_t n_values = source.n_pixels() * source.channels;
  TexelImage result;
  result.width = source.width, result.height = source.height, result.channels = 3;
  result.floats.resize(source.n_pixels() * 3);
  for (size_t i = 0; i < n_values; ++i) {
    float value = source.bytes.empty() ? source.floats[i] : static_cast<float>(source.bytes[i]) / 255;
    if (!std::isfinite(value))
      throw Error(ErrorCode::kInput,
                  fmt::format("image '{}' holds the value {} at pixel ({}, {}); all must be finite", path, value,
                              i / source.channels % source.width, i / source.channels / source.width));
    if (source.srgb) value = srgb_to_linear(value);
    if (source.channels == 3)
      result.floats[i] = value;
    else
      for (int c = 0; c < 3; ++c) result.floats[3 * i + c] = value;
  }
  return result;
}

}  // namespace covary
