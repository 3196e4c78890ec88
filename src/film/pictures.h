// SPDX-License-Identifier: Apache-2.0
// The pictures of a file among its layers: one in most files, one for each view (eye) of stereo files and for each view
// layer of Blender. Names by renderer: docs/other-renderers.md.
#pragma once

#include <string>
#include <vector>

#include "film/image_file.h"

namespace covary {

struct Picture {
  std::string layer;                    ///< as layer_channels() takes it; "" for R G B
  std::string view;                     ///< "left"; "" if the file has one view
  std::array<std::string, 3> channels;  ///< one three times for grey
};

/// The pictures in the file's order: the layers without a name (R G B, left.R …), else those with names that renderers
/// give their picture, one for each view and view layer, else the only layer of colours, else luminance (Y). Empty if
/// there are none of these, or several of the last kind but one. Cryptomatte and vectors are never pictures.
std::vector<Picture> find_pictures(const std::vector<ExrFile::Channel>& channels);

/// Their names for messages: "'left', 'right'".
std::string text_of(const std::vector<Picture>& pictures);

/// What --layer and --view name; "" for what is not named.
struct PictureChoice {
  std::string layer;  ///< a layer, with or without its view, or a view layer ("Second" for "Second.Combined")
  std::string view;   ///< "all", or one of the file's views
};
inline bool is_unnamed(const PictureChoice& choice) { return choice.layer.empty() && choice.view.empty(); }

/// The pictures, or other layers, that match the choice; all if nothing is named. Throws Error(kInput) listing what
/// there is if nothing matches.
std::vector<Picture> chosen_pictures(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                                     const PictureChoice& choice);

/// The layer that matches the choice, "" for that without a name; for commands that work on one. Throws Error(kInput)
/// if several match.
std::string chosen_layer(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                         const PictureChoice& choice);

/// Throws Error(kInput): the file has no such layer, or with "" no picture or several, and what to do. `option`: the
/// argument that chooses a layer.
[[noreturn]] void refuse_layer(const std::string& path, const std::vector<ExrFile::Channel>& channels,
                               const std::string& layer, const std::string& option);

/// The layer's name without the name of its view: "Combined" of "Combined.left", "rgba" of "rgba_left".
std::string without_view(const std::string& layer, const std::string& view);

/// The layer `Noisy Image` of Cycles with the render that the picture `Combined` is denoised from; "" if there is none.
std::string noisy_layer(const Picture& picture, const std::vector<ExrFile::Channel>& channels);

/// Whether the layer may belong to the picture, by its view and by its view layer: "left.N" and "N", but not "right.N",
/// for "left"; "ViewLayer.Normal", but not "Second.Normal", for "ViewLayer.Combined".
bool belongs_to(const Picture& picture, const std::string& layer, const std::vector<ExrFile::Channel>& channels);

/// The view of a layer's channels; "" if it belongs to none or all of them.
std::string view_of(const std::string& layer, const std::vector<ExrFile::Channel>& channels);

}  // namespace covary
