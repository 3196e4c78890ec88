// SPDX-License-Identifier: Apache-2.0
#include "picture_options.h"

#include <algorithm>

#include "declared_options.h"

namespace covary {

void add_picture_options(CLI::App& command, PictureChoice& choice, const std::string& verb,
                         const std::string& otherwise) {
  add_value(command, "--layer", choice.layer, "LAYER",
            verb + " this layer (N, group03, …), or the picture of this view layer; " + otherwise);
  add_value(command, "--view", choice.view, "NAME|all", verb + " this view (eye) of stereo files; " + otherwise);
}

std::string chosen_layer(const std::string& path, const PictureChoice& choice) {
  if (is_unnamed(choice)) return "";
  return chosen_layer(path, inspect_image(path, ChecksumPolicy::kIgnore).channels, choice);
}

std::string layer_of_view(const std::string& path, const std::string& layer, const std::string& view) {
  return view.empty() ? layer : chosen_layer(path, PictureChoice{layer, view});
}

std::vector<PictureChoice> each_view(const std::string& path, const PictureChoice& choice) {
  if (choice.view != "all") return {choice};
  std::vector<PictureChoice> all;
  for (const Picture& picture : chosen_pictures(path, inspect_image(path, ChecksumPolicy::kIgnore).channels, choice)) {
    const PictureChoice one{picture.view.empty() ? picture.layer : choice.layer, picture.view};
    if (std::none_of(all.begin(), all.end(), [&](const PictureChoice& c) { return c.view == one.view; }))
      all.push_back(one);
  }
  return all;
}

}  // namespace covary
