// SPDX-License-Identifier: Apache-2.0
#include "film/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <memory>
#include <set>

#include "imageio/exr_header.h"
#include "imageio/image_io.h"

namespace covary {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::kInput, path + ": " + what);
}

/// Whether OpenEXR reads the file, whatever it is called.
bool is_film_or_exr(const std::string& path) {
  if (is_exr(path)) return true;
  std::error_code ignored;
  if (std::filesystem::file_size(path, ignored) == 0) fail(path, "the file is empty");
  return false;
}

ImagePlace place_of(const ImageHeader& header) {
  return {header.frame_width, header.frame_height, {header.x, header.y, header.width, header.height}};
}

std::vector<ExrFile::Channel> channels_of(const ImageHeader& header) {
  std::vector<ExrFile::Channel> result;
  for (const std::string& name : header.channels) result.push_back({name, header.type});
  return result;
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// The channels of `layer` when it has three that belong together, or one of luminance; empty when not.
std::vector<std::string> find_layer(const std::vector<ExrFile::Channel>& channels, const std::string& layer) {
  const std::string prefix = layer.empty() ? "" : layer + ".";
  const auto find = [&](const std::string& suffix) {
    for (const ExrFile::Channel& c : channels)
      if (c.name.starts_with(prefix) && lower(c.name.substr(prefix.size())) == suffix) return c.name;
    return std::string();
  };
  for (const auto& suffixes : {std::array{"r", "g", "b"}, std::array{"x", "y", "z"}}) {
    std::vector<std::string> names{find(suffixes[0]), find(suffixes[1]), find(suffixes[2])};
    // X Y Z without a layer would be a colour space, not the components of a vector.
    if (!names[0].empty() && !names[1].empty() && !names[2].empty() && (suffixes[0][0] == 'r' || !layer.empty()))
      return names;
  }
  const std::string grey = find("y");
  return grey.empty() ? std::vector<std::string>{} : std::vector{grey, grey, grey};
}

/// What may be given as a layer: every prefix with three channels.
std::vector<std::string> list_layers(const std::vector<ExrFile::Channel>& channels) {
  std::vector<std::string> layers;
  for (const ExrFile::Channel& c : channels) {
    const size_t dot = c.name.rfind('.');
    const std::string layer = dot == std::string::npos ? "" : c.name.substr(0, dot);
    if (std::find(layers.begin(), layers.end(), layer) == layers.end() && !find_layer(channels, layer).empty())
      layers.push_back(layer);
  }
  return layers;
}

}  // namespace

std::vector<std::string> layer_channels(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                        const std::string& layer) {
  std::vector<std::string> names = find_layer(channels, layer);
  if (!names.empty()) return names;
  const std::vector<std::string> layers = list_layers(channels);
  if (layer.empty() && layers.size() == 1) return find_layer(channels, layers[0]);
  for (const ExrFile::Channel& c : channels)
    if (!layer.empty() && c.name == layer) return {c.name, c.name, c.name};
  std::string known, all;
  for (const std::string& name : layers) known += (known.empty() ? "" : ", ") + (name.empty() ? "R G B" : name);
  for (size_t i = 0; i < std::min<size_t>(channels.size(), 20); ++i) all += (i ? " " : "") + channels[i].name;
  if (channels.size() > 20) all += " …";
  const std::string have = fmt::format("layers: {}; channels: {}", known.empty() ? "none" : known, all);
  if (layer.empty()) fail(path, "no channels R G B; choose a layer (" + have + ")");
  std::vector<std::string> candidates;
  std::copy_if(layers.begin(), layers.end(), std::back_inserter(candidates), [](const auto& l) { return !l.empty(); });
  for (const ExrFile::Channel& c : channels)
    if (c.name.size() > 1 && c.name.find('.') == std::string::npos) candidates.push_back(c.name);
  fail(path, fmt::format("no layer '{}'{} ({})", layer, did_you_mean(layer, candidates), have));
}

ImageInfo inspect_image(const std::string& path, ChecksumPolicy checksums) {
  if (is_film_or_exr(path)) {
    const ExrFile file(path, checksums);
    return {"openexr", file.compression(), file.place(), file.channels(), file.attributes()};
  }
  const ImageHeader header = open_image(path)->header();
  return {header.format, header.compression, place_of(header), channels_of(header), header.attributes};
}

void check_image(const std::string& path) {
  if (!is_film_or_exr(path)) return;
  const ExrFile file(path);
  for (const ExrFile::Channel& channel : file.channels()) file.check({&channel.name, 1});
}

PlacedImage read_image(const std::string& path, const std::string& layer, ChecksumPolicy checksums) {
  PlacedImage result;
  if (is_film_or_exr(path)) {
    const ExrFile file(path, checksums);
    const std::vector<std::string> names = layer_channels(path, file.channels(), layer);
    result.place = file.place();
    result.image = Image(result.place.window.width, result.place.window.height, 3);
    std::vector<ExrPlane> planes;
    const bool grey = names[0] == names[2];
    for (size_t c = 0; c < (grey ? 1 : 3); ++c)
      planes.push_back({names[c], ExrPlane::Type::kFloat, result.image.data.data() + c, 3 * sizeof(float)});
    file.read(planes);
    if (grey)
      for (size_t i = 0; i < result.image.data.size(); i += 3)
        result.image.data[i + 1] = result.image.data[i + 2] = result.image.data[i];
    return result;
  }

  const std::unique_ptr<ImageReader> file = open_image(path);
  const ImageHeader& header = file->header();
  const std::vector<std::string> names = layer_channels(path, channels_of(header), layer);
  result.place = place_of(header);
  result.low_dynamic_range = !header.floating_point;
  const size_t n_channels = header.channels.size();
  const std::vector<float> values = file->read_floats(0, static_cast<int>(n_channels));
  result.image = Image(header.width, header.height, 3);
  for (size_t c = 0; c < 3; ++c) {
    const size_t source = std::find(header.channels.begin(), header.channels.end(), names[c]) - header.channels.begin();
    for (size_t p = 0; p < result.image.data.size() / 3; ++p) {
      const float value = values[p * n_channels + source];
      result.image.data[p * 3 + c] = result.low_dynamic_range ? srgb_to_linear(value) : value;
    }
  }
  return result;
}

std::vector<std::string> image_layers(const std::vector<ExrFile::Channel>& channels) {
  std::vector<std::string> layers = list_layers(channels);
  std::set<std::string> used;
  for (const std::string& layer : layers)
    for (const std::string& name : find_layer(channels, layer)) used.insert(name);
  for (const ExrFile::Channel& c : channels)
    if (!used.contains(c.name)) layers.push_back(c.name);
  return layers;
}

}  // namespace covary
