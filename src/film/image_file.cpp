// SPDX-License-Identifier: Apache-2.0
#include "film/image_file.h"

#include <OpenImageIO/imageio.h>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <set>

namespace covary {
namespace {

[[noreturn]] void fail(const std::string& path, const std::string& what) {
  throw Error(ErrorCode::kInput, path + ": " + what);
}

/// The first bytes of a file, which tell EXR from other formats whatever the file is called.
bool is_exr(const std::string& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored))
    throw Error(ErrorCode::kIo, fmt::format("cannot read {}: it is a folder", path));
  std::FILE* file = std::fopen(path.c_str(), "rb");
  if (!file) throw Error(ErrorCode::kIo, fmt::format("cannot read {}: {}", path, std::strerror(errno)));
  unsigned char magic[4] = {0, 0, 0, 0};
  const size_t n_read = std::fread(magic, 1, 4, file);
  std::fclose(file);
  if (n_read == 0) fail(path, "the file is empty");
  return magic[0] == 0x76 && magic[1] == 0x2f && magic[2] == 0x31 && magic[3] == 0x01;
}

/// OpenImageIO's last message, without line breaks at its end.
std::string oiio_error(std::string text) {
  text.erase(text.find_last_not_of(" \n") + 1);
  return text;
}

/// An image that OpenImageIO can read; EXR never comes here.
class OtherFile {
 public:
  explicit OtherFile(const std::string& path) : path_(path) {
    OIIO::ImageSpec config;
    config["oiio:UnassociatedAlpha"] = 1;  // colours as stored: alpha is not used
    input_ = OIIO::ImageInput::open(path, &config);
    if (!input_) fail(path, fmt::format("not an image that can be read: {}", oiio_error(OIIO::geterror())));
    const OIIO::ImageSpec& s = spec();
    const double memory = static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
    if (s.width < 1 || s.height < 1 || s.nchannels < 1 || s.depth > 1 || s.deep ||
        static_cast<double>(s.width) * s.height * s.nchannels * sizeof(float) > memory)
      fail(path, fmt::format("{} x {} pixels of {} channels cannot be read", s.width, s.height, s.nchannels));
  }

  const OIIO::ImageSpec& spec() const { return input_->spec(); }
  const char* format() const { return input_->format_name(); }

  ImagePlace place() const {
    const OIIO::ImageSpec& s = spec();
    return {s.full_width, s.full_height, {s.x - s.full_x, s.y - s.full_y, s.width, s.height}};
  }

  std::vector<ExrFile::Channel> channels() const {
    std::vector<ExrFile::Channel> result;
    for (const std::string& name : spec().channelnames) result.push_back({name, spec().format.c_str()});
    return result;
  }

  std::vector<float> read() {
    std::vector<float> values(static_cast<size_t>(spec().width) * spec().height * spec().nchannels);
    if (!input_->read_image(0, 0, 0, spec().nchannels, OIIO::TypeDesc::FLOAT, values.data()))
      fail(path_, fmt::format("damaged or incomplete image: {}", oiio_error(input_->geterror())));
    return values;
  }

 private:
  std::string path_;
  std::unique_ptr<OIIO::ImageInput> input_;
};

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

ImageInfo inspect_image(const std::string& path) {
  if (is_exr(path)) {
    const ExrFile file(path);
    return {"openexr", file.compression(), file.place(), file.channels(), file.attributes()};
  }
  const OtherFile file(path);
  ImageInfo info{file.format(), "", file.place(), file.channels(), {}};
  for (const OIIO::ParamValue& value : file.spec().extra_attribs) {
    if (value.name() == "compression") info.compression = value.get_string();
    if (value.type() == OIIO::TypeDesc::STRING) info.attributes[value.name().string()] = value.get_string();
  }
  return info;
}

PlacedImage read_image(const std::string& path, const std::string& layer) {
  PlacedImage result;
  if (is_exr(path)) {
    const ExrFile file(path);
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

  OtherFile file(path);
  const std::vector<std::string> names = layer_channels(path, file.channels(), layer);
  const OIIO::ImageSpec& spec = file.spec();
  result.place = file.place();
  result.low_dynamic_range = !spec.format.is_floating_point();
  const std::vector<float> values = file.read();
  result.image = Image(spec.width, spec.height, 3);
  for (size_t c = 0; c < 3; ++c) {
    const size_t source =
        std::find(spec.channelnames.begin(), spec.channelnames.end(), names[c]) - spec.channelnames.begin();
    for (size_t p = 0; p < result.image.data.size() / 3; ++p) {
      const float value = values[p * spec.nchannels + source];
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
