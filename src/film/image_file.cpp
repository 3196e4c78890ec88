// SPDX-License-Identifier: Apache-2.0
#include "film/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <memory>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/memory_limit.h"
#include "film/input_error.h"
#include "film/pictures.h"
#include "imageio/exr_image.h"
#include "imageio/image_io.h"

namespace covary {
namespace {

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Suffixes renderers use for the channels of a colour, in lower case.
constexpr std::array kSuffixes = {std::array{"r", "g", "b"}, std::array{"red", "green", "blue"}};

using Suffixes = std::array<const char*, 3>;

/// The channels of `layer` with these suffixes, compared in lower case; empty if one is missing.
std::vector<std::string> channels_that_end(const std::vector<ExrFile::Channel>& channels, const std::string& layer,
                                           const Suffixes& suffixes) {
  const std::string prefix = layer.empty() ? "" : layer + ".";
  std::vector<std::string> names;
  for (const char* suffix : suffixes) {
    const auto ends_so = [&](const ExrFile::Channel& c) {
      return c.name.starts_with(prefix) && lower(c.name.substr(prefix.size())) == suffix;
    };
    const auto found = std::find_if(channels.begin(), channels.end(), ends_so);
    if (found == channels.end()) return {};
    names.push_back(found->name);
  }
  return names;
}

/// The channels of `layer` if it has three that belong together, or luminance alone; empty otherwise.
std::vector<std::string> find_layer(const std::vector<ExrFile::Channel>& channels, const std::string& layer) {
  std::vector<Suffixes> accepted(kSuffixes.begin(), kSuffixes.end());
  accepted.push_back({"x", "y", "z"});  // of a vector; without a layer's name, CIE XYZ
  accepted.push_back({"y", "y", "y"});
  for (const Suffixes& suffixes : accepted)
    if (std::vector<std::string> names = channels_that_end(channels, layer, suffixes); !names.empty()) return names;
  return {};
}

/// Channels by layer, and the layers' names in the file's order.
struct ChannelsByLayer {
  std::vector<std::string> names;
  std::unordered_map<std::string, std::vector<ExrFile::Channel>> channels;

  explicit ChannelsByLayer(const std::vector<ExrFile::Channel>& all) {
    for (const ExrFile::Channel& c : all) {
      const size_t dot = c.name.rfind('.');
      const std::string name = dot == std::string::npos ? "" : c.name.substr(0, dot);
      std::vector<ExrFile::Channel>& members = channels[name];
      if (members.empty()) names.push_back(name);
      members.push_back(c);
    }
  }
};

struct Layer {
  std::string name;
  std::vector<std::string> channels;  ///< three, or one three times
};

/// All valid layer names: every prefix with three channels. Visits each channel only a few times, however many there
/// are.
std::vector<Layer> find_layers(const std::vector<ExrFile::Channel>& channels) {
  const ChannelsByLayer by_layer(channels);
  std::vector<Layer> layers;
  for (const std::string& name : by_layer.names)
    if (std::vector<std::string> found = find_layer(by_layer.channels.at(name), name); !found.empty())
      layers.push_back({name, std::move(found)});
  return layers;
}

constexpr double kImageBytes = 3 * sizeof(float);  // per pixel

}  // namespace

bool is_exr_image(const std::string& path) {
  if (is_exr(path)) return true;
  std::error_code ignored;
  if (std::filesystem::file_size(path, ignored) == 0) fail_input(path, "the file is empty");
  return false;
}

void require_image_memory(const std::string& path, int width, int height, double bytes_per_pixel) {
  require_memory(path, fmt::format("an image of {} x {} pixels", width, height),
                 bytes_per_pixel * static_cast<double>(width) * height);
}

std::vector<std::string> layer_channels(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                        const std::string& layer) {
  std::vector<std::string> names = find_layer(channels, layer);
  if (!names.empty() && names[0] == names[2] && !channels_that_end(channels, layer, {"y", "ry", "by"}).empty())
    refuse_layer(path, channels, layer, "--layer");
  if (!names.empty()) return names;
  if (layer.empty()) {
    const std::vector<Layer> layers = find_layers(channels);
    if (layers.size() == 1) return layers[0].channels;
    const std::vector<Picture> pictures = find_pictures(channels);
    if (pictures.size() == 1) return {pictures[0].channels.begin(), pictures[0].channels.end()};
  }
  for (const ExrFile::Channel& c : channels)
    if (!layer.empty() && c.name == layer) return {c.name, c.name, c.name};
  refuse_layer(path, channels, layer, "--layer");
}

ImageInfo info_of(const ImageHeader& header) {
  ImageInfo info{header.format, header.compression, {}, {}, header.attributes};
  info.place = {header.frame_width, header.frame_height, {header.x, header.y, header.width, header.height}};
  for (const std::string& name : header.channels) info.channels.push_back({name, header.type});
  return info;
}

namespace {

ImageInfo info_of(const ExrFile& file) {
  return {"openexr",         file.compression(), file.place(),     file.channels(),
          file.attributes(), file.colours(),     file.unreadable()};
}

}  // namespace

ImageInfo inspect_image(const std::string& path, ChecksumPolicy checksums) {
  return is_exr_image(path) ? info_of(ExrFile(path, checksums)) : info_of(open_image(path)->header());
}

ImageInfo describe_image(const std::string& path) {
  return is_exr_image(path) ? info_of(ExrFile(path, ChecksumPolicy::kIgnore, true)) : inspect_image(path);
}

void check_image(const std::string& path) {
  if (!is_exr_image(path)) return;
  const ExrFile file(path);
  for (const ExrFile::Channel& channel : file.channels()) file.check({&channel.name, 1});
}

std::vector<Image> read_layers(const ExrFile& file, const std::string& path, std::span<const std::string> layers,
                               int first_row, int n_rows) {
  const CropWindow window = file.place().window;
  require_image_memory(path, window.width, n_rows, kImageBytes * static_cast<double>(layers.size()));
  std::vector<Image> images;
  std::vector<ExrPlane> planes;
  std::vector<size_t> grey;
  images.reserve(layers.size());  // planes point into them, so no reallocation
  for (const std::string& layer : layers) {
    const std::vector<std::string> names = layer_channels(path, file.channels(), layer);
    Image& image = images.emplace_back(window.width, n_rows, 3);
    if (names[0] == names[2]) grey.push_back(images.size() - 1);
    for (size_t c = 0; c < (names[0] == names[2] ? 1 : 3); ++c)
      planes.push_back({names[c], ExrPlane::Type::kFloat, image.data.data() + c, 3 * sizeof(float)});
  }
  if (n_rows == window.height)
    file.read(planes);
  else
    file.read_rows(planes, first_row, n_rows);
  for (const size_t i : grey) {
    std::vector<float>& data = images[i].data;
    for (size_t k = 0; k < data.size(); k += 3) data[k + 1] = data[k + 2] = data[k];
  }
  return images;
}

std::vector<Image> read_layers(const std::string& path, std::span<const std::string> layers) {
  std::vector<Image> images;
  if (is_exr_image(path)) {
    const ExrFile file(path);
    images = read_layers(file, path, layers, 0, file.place().window.height);
    for (size_t i = 0; i < layers.size(); ++i) {
      const std::vector<std::string> channels = layer_channels(path, file.channels(), layers[i]);
      if (const ColourSpace own = layer_colours(file.colours(), channels);
          holds_colours(channels) && !(own == ColourSpace::rec709()))
        convert_colours(colour_conversion(own, ColourSpace::rec709()), images[i]);
    }
    return images;
  }
  for (const std::string& layer : layers) images.push_back(read_image(path, layer).image);
  return images;
}

bool holds_colours(std::span<const std::string> channels) {
  if (channels[0] == channels[2]) return false;
  const size_t dot = channels[0].rfind('.');
  if (lower(std::string(last_part(channels[0]))) == "x") return dot == std::string::npos;
  const std::string layer = dot == std::string::npos ? "" : channels[0].substr(0, dot);
  const std::string name = lower(std::string(last_part(layer)));
  const auto has = [&](const char* word) { return name.find(word) != std::string::npos; };
  constexpr std::array kVectors = {"n", "nn", "ns", "ng", "p", "uv", "motion", "velocity"};
  return !has("normal") && !has("position") && !has("crypto") &&
         std::find(kVectors.begin(), kVectors.end(), name) == kVectors.end();
}

ColourSpace layer_colours(const ColourSpace& of_file, std::span<const std::string> channels) {
  return lower(std::string(last_part(channels[0]))) == "x" ? ColourSpace::xyz() : of_file;
}

std::vector<ColourLayer> colour_layers(const std::vector<ExrFile::Channel>& channels) {
  const ChannelsByLayer by_layer(channels);
  std::vector<ColourLayer> layers;
  for (const std::string& name : by_layer.names)
    for (const Suffixes& suffixes : kSuffixes)
      if (auto found = channels_that_end(by_layer.channels.at(name), name, suffixes); !found.empty())
        layers.push_back({name, {found[0], found[1], found[2]}});
  const auto is_unnamed = [](const ColourLayer& layer) { return layer.name.empty(); };
  if (by_layer.channels.contains("") && std::none_of(layers.begin(), layers.end(), is_unnamed))
    if (auto xyz = channels_that_end(by_layer.channels.at(""), "", {"x", "y", "z"}); !xyz.empty())
      layers.push_back({"", {xyz[0], xyz[1], xyz[2]}});
  return layers;
}

std::string_view last_part(std::string_view name) {
  const size_t dot = name.rfind('.');
  return dot == std::string_view::npos ? name : name.substr(dot + 1);
}

std::vector<std::string> image_layers(const std::vector<ExrFile::Channel>& channels) {
  std::vector<std::string> names;
  std::set<std::string> used;
  for (const Layer& layer : find_layers(channels)) {
    names.push_back(layer.name);
    used.insert(layer.channels.begin(), layer.channels.end());
  }
  for (const ExrFile::Channel& c : channels)
    if (!used.contains(c.name)) names.push_back(c.name);
  return names;
}

}  // namespace covary
