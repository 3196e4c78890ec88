// SPDX-License-Identifier: Apache-2.0
// Layers of an image that guide a denoiser.
#pragma once

#include <optional>
#include <string>

#include "film/image_file.h"

namespace covary {

/// Layer `name` of the image at `path`, if it has one with three channels that begin so. Throws as read_image() and
/// check_guide().
std::optional<Image> guide_layer(const std::string& path, const ImageInfo& info, const std::string& name);

}  // namespace covary
