// SPDX-License-Identifier: Apache-2.0
// --layer and --view: which picture of files with several.
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

#include "film/pictures.h"

namespace covary {

/// `verb`: "Denoise"; `otherwise`: what happens without them.
void add_picture_options(CLI::App& command, PictureChoice& choice, const std::string& verb,
                         const std::string& otherwise);

/// chosen_layer() of the file.
std::string chosen_layer(const std::string& path, const PictureChoice& choice);

/// `layer`, if no view is named; otherwise that of the view.
std::string layer_of_view(const std::string& path, const std::string& layer, const std::string& view);

/// The choices that --view all stands for, of this file; otherwise the choice alone.
std::vector<PictureChoice> each_view(const std::string& path, const PictureChoice& choice);

}  // namespace covary
