// SPDX-License-Identifier: Apache-2.0
#include "combine/beauty_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <memory>
#include <set>
#include <utility>

#include "core/error.h"
#include "estimators/mean.h"
#include "film/exr_copy.h"

namespace covary {
namespace {

constexpr const char* kAll = "all";
/// Before the names of lights: Blender and covary, Arnold, Karma.
constexpr std::array kOfLights = {"Combined_", "RGBA_", "C_"};
/// Blender's kinds of light: direct and indirect, times the colour of the surface; before and since 5.0.
constexpr std::array kBlender = {
    std::array{"DiffDir", "DiffCol"},
    std::array{"DiffInd", "DiffCol"},
    std::array{"GlossDir", "GlossCol"},
    std::array{"GlossInd", "GlossCol"},
    std::array{"TransDir", "TransCol"},
    std::array{"TransInd", "TransCol"},
    std::array{"Diffuse Direct", "Diffuse Color"},
    std::array{"Diffuse Indirect", "Diffuse Color"},
    std::array{"Glossy Direct", "Glossy Color"},
    std::array{"Glossy Indirect", "Glossy Color"},
    std::array{"Transmission Direct", "Transmission Color"},
    std::array{"Transmission Indirect", "Transmission Color"},
};
/// Arnold's kinds of light, with _direct and _indirect, or without if it did not split them.
constexpr std::array kArnold = {"diffuse", "specular", "coat", "sheen", "transmission", "sss", "volume"};
/// The others, of Blender before and since 5.0, and of Arnold.
constexpr std::array kOthers = {"VolumeDir",       "VolumeInd", "Emit",        "Env",      "Volume Direct",
                                "Volume Indirect", "Emission",  "Environment", "emission", "background"};

class Search {
 public:
  Search(const Picture& picture, const std::vector<ExrFile::Channel>& channels) {
    for (const ColourLayer& layer : colour_layers(channels)) {
      const std::string bare = without_view(layer.name, view_of(layer.name, channels));
      if (belongs_to(picture, layer.name, channels)) names_.try_emplace(std::string(last_part(bare)), layer.name);
    }
  }

  std::vector<BeautyLayer> run() {
    for (const auto& [name, layer] : names_)
      for (const char* prefix : kOfLights)
        if (name.starts_with(prefix)) found_.push_back({layer, "", "lights"});
    for (const auto& [light, colour] : kBlender)
      if (names_.contains(colour)) add(light, colour, "components");
    for (const std::string kind : kArnold) {
      const bool split = names_.contains(kind + "_direct") || names_.contains(kind + "_indirect");
      if (!split) add(kind, "", "components");
      for (const char* part : {"_direct", "_indirect"}) add(kind + part, "", "components");
    }
    const bool has_components =
        std::any_of(found_.begin(), found_.end(), [](const BeautyLayer& l) { return l.sum == "components"; });
    for (const char* direct : {"direct", "indirect", "Direct", "Indirect"}) add(direct, "", "direct");
    const bool has_direct = !found_.empty() && found_.back().sum == "direct";
    for (const char* other : kOthers)
      if (has_components || has_direct) add(other, "", has_components ? "components" : "direct");
    return found_;
  }

 private:
  void add(const std::string& name, const std::string& colour, const char* sum) {
    if (const auto it = names_.find(name); it != names_.end())
      found_.push_back({it->second, colour.empty() ? "" : names_.at(colour), sum});
  }

  std::map<std::string, std::string> names_;  // last part -> layer
  std::vector<BeautyLayer> found_;
};

/// The values of one source times those of another.
GroupedSource product(const GroupedSource& light, const GroupedSource& colour) {
  GroupedSource result = light;
  result.rows = [a = light.rows, b = colour.rows, data = std::make_shared<std::vector<float>>()](int first, int n) {
    GroupedImage image = a(first, n);
    const GroupedImage factors = b(first, n);
    data->assign(image.data, image.pixel(0, n));
    for (size_t i = 0; i < data->size(); ++i) (*data)[i] *= factors.data[i];
    image.data = data->data();
    return image;
  };
  return result;
}

/// Whether the groups of any pixel differ.
bool is_noisy(const GroupedSource& source) {
  const GroupedImage image = source.all();
  const size_t n = static_cast<size_t>(image.width) * image.height;
  for (size_t i = 0; i < n; ++i)
    for (int t = 1; t < image.groups; ++t)
      if (const float* p = image.data + 3 * i * image.groups; p[3 * t] != p[0]) return true;
  return false;
}

bool all_have(const std::string& channel, const std::vector<std::string>& files) {
  return std::ranges::all_of(files, [&](const std::string& file) {
    return std::ranges::any_of(inspect_image(file).channels,
                               [&](const ExrFile::Channel& c) { return c.name == channel; });
  });
}

}  // namespace

std::vector<BeautyLayer> find_beauty_layers(const Picture& picture, const std::vector<ExrFile::Channel>& channels) {
  return Search(picture, channels).run();
}

BeautyLayers::BeautyLayers(const std::vector<std::string>& files, const Picture& picture,
                           const std::vector<std::string>& names, bool with_alpha) {
  const std::vector<ExrFile::Channel> channels = inspect_image(files[0]).channels;
  for (const std::string& name : names) {
    if (name != kAll) {
      add(files, {name, "", ""});
      continue;
    }
    const std::vector<BeautyLayer> found = find_beauty_layers(picture, channels);
    if (found.empty())
      throw Error(ErrorCode::kInput,
                  fmt::format("{}: no layers of lights, and none of direct and indirect light, by the "
                              "names of Blender or Arnold; name them by --layers",
                              files[0]));
    std::set<std::string> sums;
    for (const BeautyLayer& layer : found) sums.insert(layer.sum);
    for (BeautyLayer layer : found) {
      if (sums.size() == 1) layer.sum.clear();
      add(files, layer);
    }
  }
  if (!with_alpha || files.size() < 2) return;
  alpha_ = alpha_channel(channels, picture.channels[0]);
  if (!alpha_.empty() && all_have(alpha_, files)) {
    files_.emplace_back(files, alpha_);
    if (is_noisy(source_of(files_.back()))) return;
    files_.pop_back();
  }
  alpha_.clear();
}

void BeautyLayers::add(const std::vector<std::string>& files, const BeautyLayer& layer) {
  Entry entry{layer, &files_.emplace_back(files, layer.name)};
  if (!layer.colour.empty()) entry.colour = &files_.emplace_back(files, layer.colour);
  entries_.push_back(entry);
}

std::vector<LayerSource> BeautyLayers::sources() const {
  std::vector<LayerSource> sources;
  for (const Entry& entry : entries_) {
    const GroupedSource light = source_of(*entry.file);
    sources.push_back(
        {entry.layer.name, entry.colour ? product(light, source_of(*entry.colour)) : light, entry.layer.sum});
  }
  if (!alpha_.empty()) sources.push_back({alpha_, source_of(files_.back()), std::nullopt});
  return sources;
}

void BeautyLayers::finish(std::map<std::string, Image>& layers) const {
  for (const Entry& entry : entries_) {
    const auto layer = layers.find(entry.layer.name);
    if (!entry.colour || layer == layers.end()) continue;
    const Image colour = mean_of_groups(source_of(*entry.colour).all()).estimate;
    const Image light = mean_of_groups(source_of(*entry.file).all()).estimate;
    Image& image = layer->second;
    Image lost(image.width, image.height, 3);  // which filters carried to where the colour is 0
    for (size_t i = 0; i < colour.data.size(); ++i)
      if (colour.data[i] > 0)
        image.data[i] /= colour.data[i];
      else
        lost.data[i] = std::exchange(image.data[i], light.data[i]);
    if (std::ranges::all_of(lost.data, [](float value) { return value == 0; })) continue;
    const std::string sum = entry.layer.sum.empty() ? "" : "_" + entry.layer.sum;
    Image& rest = layers.try_emplace(kRest + sum, image.width, image.height, 3).first->second;
    std::transform(rest.data.begin(), rest.data.end(), lost.data.begin(), rest.data.begin(), std::plus<>());
  }
  const auto alpha = layers.find(alpha_);
  if (alpha_.empty() || alpha == layers.end()) return;
  Image one(alpha->second.width, alpha->second.height, 1);
  for (size_t i = 0; i < one.data.size(); ++i) one.data[i] = std::clamp(alpha->second.data[3 * i], 0.0f, 1.0f);
  alpha->second = std::move(one);
}

}  // namespace covary
