// SPDX-License-Identifier: Apache-2.0
#include "guide_layer.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <span>

#include "core/error.h"
#include "denoising/denoise.h"
#include "metrics/alignment.h"

namespace covary {
namespace {

/// Last parts of layer names; layers that see through mirrors and glass come first. Sources: docs/other-renderers.md.
constexpr std::array<std::string_view, 7> kAlbedo = {
    "DenoisingAlbedo",   // covary --aovs
    "Denoising Albedo",  // Blender
    "denoise_albedo",    // Arnold
    "Albedo",            // covary, pbrt-v4
    "albedo",            // Mitsuba 3 by our example, RenderMan
    "ALBEDO",            // LuxCore
    "VRayDiffuseFilter"  // V-Ray
};
constexpr std::array<std::string_view, 9> kNormal = {
    "DenoisingNormal",     // covary --aovs
    "Denoising Normal",    // Blender
    "Ns",                  // shading normal
    "N",                   // geometric normal
    "sh_normal",           // Mitsuba 3
    "normal",              // RenderMan
    "AVG_SHADING_NORMAL",  // LuxCore
    "bump_normals",        // V-Ray
    "normals"              // V-Ray
};

constexpr std::array<std::string_view, 3> kPosition = {
    "P",         // covary --aovs, pbrt-v4, Arnold
    "Position",  // Blender
    "position"   // Mitsuba 3 by our example
};

bool has_three_channels(const ImageInfo& info, const std::string& layer) {
  return std::count_if(info.channels.begin(), info.channels.end(), [&](const ExrFile::Channel& c) {
           return c.name.starts_with(layer + ".") && c.name.find('.', layer.size() + 1) == std::string::npos;
         }) == 3;
}

/// Whether the layer may show the same view as the picture: "left.N" and "N", but not "right.N", for "left"; and
/// "ViewLayer.Normal" for "ViewLayer.Combined".
bool is_of(const std::string& picture, const std::string& layer) {
  const auto folder = [](const std::string& name) {
    const size_t dot = name.rfind('.');
    return dot == std::string::npos ? std::string() : name.substr(0, dot);
  };
  const std::string of_layer = folder(layer);
  return of_layer.empty() || of_layer == picture || of_layer == folder(picture);
}

/// The space to convert a guide to; none for vectors, even if their components are called R, G and B.
std::optional<ColourSpace> space_of(GuideKind kind, const ColourSpace& colours) {
  return kind == GuideKind::kAlbedo ? std::optional(colours) : std::nullopt;
}

Image checked_guide(const std::string& path, const std::string& layer, const std::optional<ColourSpace>& colours) {
  Image guide = read_image(path, layer, ChecksumPolicy::kCheck, colours).image;
  check_guide(path + (layer.empty() ? "" : ": the layer " + layer), guide);
  return guide;
}

/// The pixels of the image at `path` in a separate file.
Image guide_from_file(const std::string& path, const ImagePlace& place, const std::string& file,
                      const std::optional<ColourSpace>& colours) {
  PlacedImage guide = read_image(file, "", ChecksumPolicy::kCheck, colours);
  const CropWindow common = common_window(path, place, place.window, file, guide.place);
  if (!(common == place.window))
    throw Error(ErrorCode::kInput, fmt::format("'{}' has the pixels {}; '{}' needs {}", file,
                                               text_of(guide.place.window), path, text_of(place.window)));
  Image pixels = cut(std::move(guide), place.window);
  check_guide(file, pixels);
  return pixels;
}

}  // namespace

std::optional<Image> find_guide(const std::string& path, const ImageInfo& info, GuideKind kind,
                                const ColourSpace& colours, const std::string& picture) {
  std::vector<std::string> layers = image_layers(info.channels);
  if (!picture.empty()) std::erase_if(layers, [&](const std::string& layer) { return !is_of(picture, layer); });
  const std::span<const std::string_view> all[] = {kAlbedo, kNormal, kPosition};
  for (const std::string_view name : all[static_cast<int>(kind)])
    for (const std::string& layer : layers)
      if (last_part(layer) == name && has_three_channels(info, layer))
        return checked_guide(path, layer, space_of(kind, colours));
  return std::nullopt;
}

Image named_guide(const std::string& path, const ImageInfo& info, GuideKind kind, const ColourSpace& colours,
                  const std::string& layer_or_file) {
  const std::vector<std::string> layers = image_layers(info.channels);
  const bool is_layer = std::find(layers.begin(), layers.end(), layer_or_file) != layers.end();
  if (!is_layer && std::filesystem::exists(layer_or_file))
    return guide_from_file(path, info.place, layer_or_file, space_of(kind, colours));
  return checked_guide(path, layer_or_file, space_of(kind, colours));  // its error lists the layers
}

}  // namespace covary
