// SPDX-License-Identifier: Apache-2.0
#include "imageio/exr_picture.h"

#include <fmt/format.h>
#include <strings.h>

#include <algorithm>
#include <array>
#include <ranges>
#include <string_view>

#include "core/error.h"

namespace covary {
namespace {

constexpr std::array kPictures = {"combined", "ci", "c", "rgba", "rgb", "beauty", "default", "noisy image"};
constexpr std::array kColours = {std::array{"r", "g", "b"}, std::array{"red", "green", "blue"}};
constexpr size_t kMaxListed = 20;  // channels of a part in a message

bool same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && strncasecmp(a.data(), b.data(), a.size()) == 0;
}

/// "ViewLayer.Combined" of "ViewLayer.Combined.R"; "" without a dot.
std::string_view layer_of(std::string_view channel) {
  const size_t dot = channel.rfind('.');
  return dot == std::string_view::npos ? std::string_view() : channel.substr(0, dot);
}
std::string_view last_part(std::string_view name) { return name.substr(name.rfind('.') + 1); }

struct Candidate {
  ExrPicture picture;
  std::string layer, name;  ///< name: of the part and the layer
};

/// The channel of a layer that ends in `last`; null if there is none.
const ExrPart::Channel* find(const ExrPart& part, std::string_view layer, std::string_view last) {
  const auto it = std::ranges::find_if(part.channels, [&](const ExrPart::Channel& c) {
    return !c.subsampled && layer_of(c.name) == layer && same(last_part(c.name), last);
  });
  return it == part.channels.end() ? nullptr : &*it;
}

/// All colours of the file.
std::vector<Candidate> find_colours(std::span<const ExrPart> parts) {
  std::vector<Candidate> found;
  for (size_t p = 0; p < parts.size(); ++p)
    for (const ExrPart::Channel& channel : parts[p].channels)
      for (const auto& [r, g, b] : kColours) {
        if (parts[p].deep || channel.subsampled || !same(last_part(channel.name), r)) continue;
        const std::string layer(layer_of(channel.name));
        const auto *green = find(parts[p], layer, g), *blue = find(parts[p], layer, b);
        if (!green || !blue) continue;
        const bool both = !parts[p].name.empty() && !layer.empty();
        found.push_back({{static_cast<int>(p), {channel.name, green->name, blue->name}},
                         layer,
                         parts[p].name + (both ? "." : "") + layer});
      }
  return found;
}

/// Luminance, without a layer's name, of parts that do not have chroma, too.
std::vector<Candidate> find_luminances(std::span<const ExrPart> parts) {
  std::vector<Candidate> found;
  for (size_t p = 0; p < parts.size(); ++p) {
    const ExrPart::Channel* y = parts[p].deep ? nullptr : find(parts[p], "", "y");
    const bool other = std::ranges::any_of(parts[p].channels, [](const ExrPart::Channel& c) {
      return same(c.name, "x") || same(c.name, "ry") || same(c.name, "by");
    });
    if (y && !other) found.push_back({{static_cast<int>(p), {y->name}}, "", parts[p].name});
  }
  return found;
}

std::string listed(const ExrPart& part) {
  std::string text;
  for (size_t i = 0; i < std::min(part.channels.size(), kMaxListed); ++i)
    text += (i ? ", " : "") + part.channels[i].name;
  return text + (part.channels.size() > kMaxListed ? ", …" : "") + (part.deep ? ", deep" : "");
}

std::string listed(std::span<const ExrPart> parts) {
  if (parts.size() == 1) return "the channels " + listed(parts[0]);
  std::string text = "the parts";
  for (const ExrPart& part : parts)
    text += fmt::format("{} '{}' ({})", text == "the parts" ? "" : ",", part.name, listed(part));
  return text;
}

/// The only candidate, or the only one that is named as a picture. Throws if there are several.
ExrPicture choose(const std::vector<Candidate>& candidates, std::span<const ExrPart> parts, const std::string& path) {
  if (candidates.size() == 1) return candidates[0].picture;
  const auto rank = [](const Candidate& c) { return rank_as_picture(c.name); };
  const int best = std::ranges::min(candidates | std::views::transform(rank));
  if (best != kNoPicture && std::ranges::count(candidates, best, rank) == 1)
    return std::ranges::find(candidates, best, rank)->picture;
  throw Error(ErrorCode::kInput, fmt::format("{} has {}: {} pictures; a texture needs one, or one named {}", path,
                                             listed(parts), candidates.size(), "'beauty' or 'rgba'"));
}

}  // namespace

int rank_as_picture(std::string_view name) {
  const auto it = std::ranges::find_if(kPictures, [&](const char* picture) { return same(last_part(name), picture); });
  return it == kPictures.end() ? kNoPicture : static_cast<int>(it - kPictures.begin());
}

bool names_picture(std::string_view name) { return rank_as_picture(name) != kNoPicture; }

ExrPicture find_exr_picture(std::span<const ExrPart> parts, const std::string& path) {
  const std::vector<Candidate> colours = find_colours(parts);
  std::vector<Candidate> without_layer;
  std::ranges::copy_if(colours, std::back_inserter(without_layer), [](const Candidate& c) { return c.layer.empty(); });
  if (!without_layer.empty()) return choose(without_layer, parts, path);
  const std::vector<Candidate> luminances = find_luminances(parts);
  if (parts.size() == 1 && !luminances.empty()) return luminances[0].picture;
  if (!colours.empty()) return choose(colours, parts, path);
  if (!luminances.empty()) return choose(luminances, parts, path);
  if (parts.size() == 1 && !parts[0].channels.empty() && parts[0].channels.size() <= 2) {
    // OpenEXR sorts by name; red is first among colours.
    const ExrPart::Channel* first = find(parts[0], "", "r") ? find(parts[0], "", "r") : &parts[0].channels[0];
    if (same(first->name, "a") && parts[0].channels.size() == 2) first = &parts[0].channels[1];
    if (!first->subsampled && !same(first->name, "a")) return {0, {first->name}};
  }
  throw Error(ErrorCode::kInput, fmt::format("{} has {}; a texture needs R, G, B or a grey one", path, listed(parts)));
}

}  // namespace covary
