// SPDX-License-Identifier: Apache-2.0
#include "feature_layers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <limits>
#include <utility>

#include "core/error.h"
#include "core/printable.h"
#include "film/auxiliary_features.h"
#include "film/film_file.h"
#include "film/written_by.h"
#include "metrics/alignment.h"

namespace covary {
namespace {

const AuxiliaryFeature& feature_of(FeatureKind kind) {
  switch (kind) {
    case FeatureKind::kAlbedo:
      return kAuxiliaryFeatures[feature::kAlbedo];
    case FeatureKind::kNormal:
      return kAuxiliaryFeatures[feature::kNormal];
    case FeatureKind::kPosition:
      break;
  }
  return kAuxiliaryFeatures[feature::kPosition];
}

bool has_three_channels(const std::string& path, const ImageInfo& info, const std::string& layer) {
  const std::vector<std::string> names = layer_channels(path, info.channels, layer);
  return names[0] != names[2];
}

/// Reports the first value that is not finite, and makes all such pixels NaN.
void leave_out_bad_pixels(const std::string& name, Image& feature) {
  size_t n = 0;
  std::string first;
  for (size_t i = 0; i < feature.data.size(); i += 3) {
    float* pixel = &feature.data[i];
    const float* bad = std::find_if(pixel, pixel + 3, [](float v) { return !std::isfinite(v); });
    if (bad == pixel + 3) continue;
    if (n++ == 0) {
      const auto at = static_cast<int>(i / 3);
      first = fmt::format("{} at ({}, {})", *bad, at % feature.width, at / feature.width);
    }
    std::fill_n(pixel, 3, std::numeric_limits<float>::quiet_NaN());
  }
  if (n > 0)
    fmt::print(stderr, "warning: {}: {} of {} pixels of this feature are left out, the first with the value {}\n",
               printable(name), n, feature.data.size() / 3, first);
}

/// The space to convert a feature to; none for vectors, even if their components are called R, G and B.
std::optional<ColourSpace> space_of(FeatureKind kind, const ColourSpace& colours) {
  return feature_of(kind).is_colour ? std::optional(colours) : std::nullopt;
}

Image usable_feature(const std::string& path, const std::string& layer, const std::optional<ColourSpace>& colours) {
  Image feature = read_image(path, layer, ChecksumPolicy::kCheck, colours).image;
  leave_out_bad_pixels(path + (layer.empty() ? "" : ": the layer " + layer), feature);
  return feature;
}

/// The pixels of the image at `path` in a separate file.
Image feature_from_file(const std::string& path, const ImagePlace& place, const std::string& file,
                        const std::optional<ColourSpace>& colours) {
  PlacedImage feature = read_image(file, "", ChecksumPolicy::kCheck, colours);
  const CropWindow common = common_window(path, place, place.window, file, feature.place);
  if (!(common == place.window))
    throw Error(ErrorCode::kInput, fmt::format("'{}' has the pixels {}; '{}' needs {}", file,
                                               text_of(feature.place.window), path, text_of(place.window)));
  Image pixels = cut(std::move(feature), place.window);
  leave_out_bad_pixels(file, pixels);
  return pixels;
}

}  // namespace

std::optional<Image> find_feature(const std::string& path, const ImageInfo& info, FeatureKind kind,
                                  const ColourSpace& colours, const Picture& picture) {
  const AuxiliaryFeature& first = feature_of(kind);
  const std::vector<std::string> layers = image_layers(info.channels);
  const auto find = [&](const AuxiliaryFeature& feature) -> std::optional<Image> {
    for (const std::string_view name : feature.names)
      for (const std::string& layer : layers)
        if (last_part(without_view(layer, view_of(layer, info.channels))) == name &&
            belongs_to(picture, layer, info.channels) && has_three_channels(path, info, layer))
          return usable_feature(path, layer, space_of(kind, colours));
    return std::nullopt;
  };
  std::optional<Image> behind;
  if (first.behind != feature::kCount) behind = find(kAuxiliaryFeatures[first.behind]);
  return behind ? std::move(behind) : find(first);
}

Image named_feature(const std::string& path, const ImageInfo& info, FeatureKind kind, const ColourSpace& colours,
                    const std::string& layer_or_file) {
  const std::vector<std::string> layers = image_layers(info.channels);
  const bool is_layer = std::find(layers.begin(), layers.end(), layer_or_file) != layers.end();
  if (!is_layer && std::filesystem::exists(layer_or_file))
    return feature_from_file(path, info.place, layer_or_file, space_of(kind, colours));
  return usable_feature(path, layer_or_file, space_of(kind, colours));  // its error lists the layers
}

std::optional<Image> filled(std::optional<Image> feature) {
  if (feature)
    std::replace_if(
        feature->data.begin(), feature->data.end(), [](float v) { return std::isnan(v); }, 0.0f);
  return feature;
}

FeatureImages read_features(const std::string& path, const ImagePlace& place, const ColourSpace& colours) {
  const ImageInfo info = inspect_image(path);
  const auto own = [&](feature::Index index,
                       FeatureKind kind) -> std::optional<Image> {  // features that `render` wrote
    const std::string name = kAuxiliaryFeatures[index].layer;
    const bool is_there = std::any_of(info.channels.begin(), info.channels.end(),
                                      [&](const auto& c) { return c.name.starts_with(name + "."); });
    return is_there ? filled(named_feature(path, info, kind, colours, name)) : std::nullopt;
  };
  const auto find = [&](FeatureKind kind) { return filled(find_feature(path, info, kind, colours)); };
  FeatureImages features{own(feature::kAlbedo, FeatureKind::kAlbedo),
                         own(feature::kNormal, FeatureKind::kNormal),
                         own(feature::kDenoisingAlbedo, FeatureKind::kAlbedo),
                         own(feature::kDenoisingNormal, FeatureKind::kNormal),
                         info.attributes.contains(std::string("covary:") + film_key::kCleanFeatures),
                         find(FeatureKind::kPosition)};
  if (!features.albedo) features.albedo = find(FeatureKind::kAlbedo);
  if (!features.normal) features.normal = find(FeatureKind::kNormal);
  for (std::optional<Image>* albedo : {&features.albedo, &features.denoising_albedo})
    if (*albedo) limit_albedo(**albedo);
  if (!features.albedo)
    throw Error(ErrorCode::kInput,
                fmt::format("--features '{}' has no layer Albedo (Albedo.R, .G, .B) under any known name", path));
  if (const CropWindow& there = info.place.window, &here = place.window; !(info.place == place))
    throw Error(ErrorCode::kInput,
                fmt::format("--features '{}' has the pixels {}, the images {}, or another frame around them", path,
                            text_of(there), text_of(here)));
  return features;
}

FeatureLayers::FeatureLayers(const FeatureSearch& search, bool are_groups) {
  if (search.none) return;
  are_own_ = inspect_image(search.files[0]).attributes.contains(std::string("covary:") + film_key::kSceneHash);
  features_ = RenderFeatures(are_groups);
  const auto add = [&](feature::Index kind, FeatureKind of_file, const std::string& name) {
    for (const std::string& path : search.files) {
      const ImageInfo info = inspect_image(path);
      std::optional<Image> feature = name.empty() ? find_feature(path, info, of_file, search.colours, search.picture)
                                                  : named_feature(path, info, of_file, search.colours, name);
      std::optional<PlacedImage> picture;
      if (are_groups && !are_own_ && feature && feature_of(of_file).is_colour)
        picture = read_image(path, search.picture.layer, ChecksumPolicy::kCheck, std::nullopt);
      features_.add(kind, path, std::move(feature), picture ? &picture->image : nullptr);
    }
    features_.close(kind);
  };
  add(feature::kAlbedo, FeatureKind::kAlbedo, search.albedo);
  add(feature::kNormal, FeatureKind::kNormal, search.normal);
  add(feature::kPosition, FeatureKind::kPosition, "");
}

std::string FeatureLayers::text() const {
  if (!features_.has(feature::kAlbedo))
    return std::string("without auxiliary features") + (are_own_ ? ", which `covary render --aovs` writes" : "");
  return features_.has(feature::kNormal) ? "guided by albedo and normal" : "guided by albedo";
}

}  // namespace covary
