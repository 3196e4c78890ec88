// SPDX-License-Identifier: Apache-2.0
#include "film/pictures.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <string_view>

#include "core/error.h"
#include "film/input_error.h"
#include "imageio/exr_picture.h"

namespace covary {
namespace {

constexpr const char* kAll = "all";
/// The picture that Blender's compositor made, in the file of the renders that it was made of.
constexpr const char* kComposite = "Composite";

/// Layers of this project's results that tell of the picture beside them.
constexpr std::array<std::string_view, 2> kEstimatedErrors = {"StdError", "Bias"};

std::string folder_of(const std::string& name) {
  const size_t dot = name.rfind('.');
  return dot == std::string::npos ? std::string() : name.substr(0, dot);
}

/// A layer that may be a picture.
struct Candidate {
  Picture picture;
  std::string name, folder;  ///< without the view; that up to the last dot
  int rank = kNoPicture;     ///< -1 without a name
};

std::vector<Candidate> candidates_of(const std::vector<ExrFile::Channel>& channels) {
  std::map<std::string, std::string> views;  // by channel: files may have many thousand layers
  for (const ExrFile::Channel& c : channels)
    if (!c.view.empty()) views[c.name] = c.view;
  std::vector<Candidate> all;
  for (const ColourLayer& layer : colour_layers(channels)) {
    if (!holds_colours(layer.channels)) continue;
    const auto view = views.find(layer.channels[0]);
    Candidate c{{layer.name, view == views.end() ? "" : view->second, layer.channels}, "", ""};
    c.name = without_view(layer.name, c.picture.view);
    c.folder = folder_of(c.name);
    c.rank = c.name.empty() ? -1 : rank_as_picture(c.name);
    all.push_back(std::move(c));
  }
  return all;
}

bool is_estimated_error(const Candidate& c) {
  return std::find(kEstimatedErrors.begin(), kEstimatedErrors.end(), last_part(c.name)) != kEstimatedErrors.end();
}

std::vector<Picture> pictures_of(const std::vector<Candidate>& candidates, auto&& accepts) {
  std::vector<Picture> pictures;
  for (const Candidate& c : candidates)
    if (accepts(c)) pictures.push_back(c.picture);
  return pictures;
}

/// The best name of each view layer and view.
std::vector<Picture> named_pictures(const std::vector<Candidate>& candidates) {
  std::map<std::pair<std::string, std::string>, int> best;
  for (const Candidate& c : candidates) {
    int& rank = best.try_emplace({c.folder, c.picture.view}, kNoPicture).first->second;
    rank = std::min(rank, c.rank);
  }
  const auto is_best = [&](const Candidate& c) {
    return c.rank < kNoPicture && c.rank == best.at({c.folder, c.picture.view});
  };
  const std::vector<Picture> rendered =
      pictures_of(candidates, [&](const Candidate& c) { return is_best(c) && c.folder != kComposite; });
  return rendered.empty() ? pictures_of(candidates, is_best) : rendered;
}

/// Luminance, of files without colours.
std::vector<Picture> grey_pictures(const std::vector<ExrFile::Channel>& channels) {
  std::vector<Picture> pictures;
  for (const ExrFile::Channel& c : channels) {
    const std::string layer = folder_of(c.name);
    const bool has_chroma = std::any_of(channels.begin(), channels.end(), [&](const ExrFile::Channel& other) {
      return other.name == (layer.empty() ? "" : layer + ".") + "RY";
    });
    if (last_part(c.name) == "Y" && !has_chroma && without_view(layer, c.view).empty())
      pictures.push_back({layer, c.view, {c.name, c.name, c.name}});
  }
  return pictures;
}

std::string listed_views(const std::vector<ExrFile::Channel>& channels) {
  std::set<std::string> views;
  for (const ExrFile::Channel& c : channels)
    if (!c.view.empty()) views.insert(fmt::format("'{}'", c.view));
  return views.empty() ? "it has one view" : fmt::format("its views: {}", fmt::join(views, ", "));
}

/// The layers that --layer may mean, of all views.
std::vector<Picture> layers_named(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                  const std::string& name) {
  std::vector<Picture> found;
  const std::vector<std::string> layers = image_layers(channels);
  const auto add_if = [&](auto&& matches) {
    for (const std::string& layer : layers) {
      if (!matches(layer)) continue;
      const std::vector<std::string> c = layer_channels(path, channels, layer);
      found.push_back({layer, view_of(layer, channels), {c[0], c[1], c[2]}});
    }
  };
  add_if([&](const std::string& layer) { return layer == name; });
  if (!found.empty()) return found;
  for (const Picture& picture : find_pictures(channels))
    if (folder_of(without_view(picture.layer, picture.view)) == name) found.push_back(picture);
  if (!found.empty()) return found;
  add_if([&](const std::string& layer) { return without_view(layer, view_of(layer, channels)) == name; });
  return found;
}

/// The names, at most 20 of them.
std::string listed(const std::vector<std::string>& names, const char* separator) {
  constexpr size_t kMaxNamed = 20;
  const auto n = static_cast<ptrdiff_t>(std::min(names.size(), kMaxNamed));
  const std::string text = fmt::format("{}", fmt::join(names.begin(), names.begin() + n, separator));
  return names.size() > kMaxNamed ? text + separator + "…" : text;
}

/// What a file holds, for messages.
struct Contents {
  std::vector<std::string> layers, channels;
  std::vector<std::string> names;  ///< that may have been meant

  explicit Contents(const std::vector<ExrFile::Channel>& all) {
    for (const ExrFile::Channel& c : all) channels.push_back(c.name);
    const std::set<std::string> is_channel(channels.begin(), channels.end());
    for (const std::string& layer : image_layers(all)) {
      if (!is_channel.contains(layer)) layers.push_back(layer.empty() ? "R G B" : layer);
      if (layer.size() > 1) names.push_back(layer);
    }
  }
  std::string text() const {
    return fmt::format("layers: {}; channels: {}", layers.empty() ? "none" : listed(layers, ", "),
                       listed(channels, " "));
  }
};

/// Whether all layers of colours are mattes, as in Cryptomatte's files beside the picture's.
bool holds_mattes_only(const std::vector<ExrFile::Channel>& channels) {
  const std::vector<ColourLayer> layers = colour_layers(channels);
  return !layers.empty() && std::all_of(layers.begin(), layers.end(), [](const ColourLayer& layer) {
    return !holds_colours(layer.channels) && layer.name.find("rypto") != std::string::npos;
  });
}

}  // namespace

void refuse_layer(const std::string& path, const std::vector<ExrFile::Channel>& channels, const std::string& layer,
                  const std::string& option) {
  const auto has = [&](const std::string& name) {
    return std::any_of(channels.begin(), channels.end(), [&](const ExrFile::Channel& c) {
      return c.name == (layer.empty() ? name : layer + "." + name);
    });
  };
  if (has("Y") && has("RY") && has("BY"))
    fail_input(path, "luminance and chroma of full resolution (channels Y, RY, BY); save the picture as R, G and B");
  const Contents contents(channels);
  if (!layer.empty())
    fail_input(path, fmt::format("no layer '{}'{} ({})", layer, did_you_mean(layer, contents.names), contents.text()));
  const std::vector<Picture> pictures = find_pictures(channels);
  if (pictures.size() > 1)
    fail_input(path, fmt::format("several pictures, {}; choose one by {}{}", text_of(pictures),
                                 pictures[0].view.empty() ? "" : "--view or ", option));
  if (holds_mattes_only(channels))
    fail_input(path,
               fmt::format("no picture, only mattes (Cryptomatte); give the file that holds the picture, or choose a "
                           "layer by {} ({})",
                           option, contents.text()));
  if (contents.layers.empty() && !channels.empty())
    fail_input(path, fmt::format("no channels R G B; choose a channel by {}, such as '{}' (channels: {})", option,
                                 channels[0].name, listed(contents.channels, " ")));
  fail_input(path, fmt::format("no channels R G B; choose a layer by {} ({})", option, contents.text()));
}

std::string text_of(const std::vector<Picture>& pictures) {
  std::vector<std::string> names;
  for (const Picture& p : pictures) names.push_back(p.layer.empty() ? "R G B" : fmt::format("'{}'", p.layer));
  return fmt::format("{}", fmt::join(names, ", "));
}

std::string view_of(const std::string& layer, const std::vector<ExrFile::Channel>& channels) {
  for (const ExrFile::Channel& c : channels)
    if (folder_of(c.name) == layer || c.name == layer) return c.view;
  return "";
}

std::string without_view(const std::string& layer, const std::string& view) {
  if (view.empty()) return layer;
  if (layer == view) return "";
  if (layer.starts_with(view + ".")) return layer.substr(view.size() + 1);
  if (layer.ends_with("_" + view)) return layer.substr(0, layer.size() - view.size() - 1);
  const size_t at = ("." + layer + ".").rfind("." + view + ".");
  return at == std::string::npos ? layer : layer.substr(0, at - 1) + layer.substr(at + view.size());
}

bool belongs_to(const Picture& picture, const std::string& layer, const std::vector<ExrFile::Channel>& channels) {
  const std::string view = view_of(layer, channels);
  if (!view.empty() && !picture.view.empty() && view != picture.view) return false;
  const std::string of_layer = folder_of(without_view(layer, view)), name = without_view(picture.layer, picture.view);
  return of_layer.empty() || name.empty() || of_layer == name || of_layer == folder_of(name);
}

std::string noisy_layer(const Picture& picture, const std::vector<ExrFile::Channel>& channels) {
  if (last_part(without_view(picture.layer, picture.view)) != "Combined") return "";
  for (const ColourLayer& layer : colour_layers(channels))
    if (last_part(without_view(layer.name, view_of(layer.name, channels))) == "Noisy Image" &&
        belongs_to(picture, layer.name, channels))
      return layer.name;
  return "";
}

std::vector<Picture> find_pictures(const std::vector<ExrFile::Channel>& channels) {
  const std::vector<Candidate> candidates = candidates_of(channels);
  std::vector<Picture> pictures = pictures_of(candidates, [](const Candidate& c) { return c.rank < 0; });
  if (pictures.empty()) pictures = named_pictures(candidates);
  if (!pictures.empty()) return pictures;
  std::set<std::string> names;
  for (const Candidate& c : candidates)
    if (!is_estimated_error(c)) names.insert(c.name);
  if (names.size() > 1) return {};
  return names.empty() ? grey_pictures(channels)
                       : pictures_of(candidates, [](const Candidate& c) { return !is_estimated_error(c); });
}

std::vector<Picture> chosen_pictures(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                     const PictureChoice& choice) {
  std::vector<Picture> found =
      choice.layer.empty() ? find_pictures(channels) : layers_named(path, channels, choice.layer);
  if (found.empty()) {
    const std::vector<std::string> c = layer_channels(path, channels, choice.layer);  // throws, or is the only layer
    found.push_back({choice.layer, view_of(choice.layer, channels), {c[0], c[1], c[2]}});
  }
  if (choice.view.empty() || choice.view == kAll) return found;
  std::erase_if(found, [&](const Picture& picture) { return picture.view != choice.view; });
  if (found.empty())
    throw Error(ErrorCode::kInput,
                fmt::format("{}: no picture of the view '{}'; {}", path, choice.view, listed_views(channels)));
  return found;
}

std::string chosen_layer(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                         const PictureChoice& choice) {
  if (is_unnamed(choice)) return "";
  const std::vector<Picture> found = chosen_pictures(path, channels, choice);
  if (found.size() == 1) return found[0].layer;
  const bool has_views = std::any_of(found.begin(), found.end(), [](const Picture& p) { return !p.view.empty(); });
  throw Error(ErrorCode::kInput, fmt::format("{}: several pictures, {}; choose one by {}--layer", path, text_of(found),
                                             has_views ? "--view or " : ""));
}

}  // namespace covary
