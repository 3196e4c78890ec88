// SPDX-License-Identifier: Apache-2.0
// Layers of an image that guide a denoiser, by each renderer's names.
#pragma once

#include <optional>
#include <string>

#include "film/image_file.h"

namespace covary {

/// Albedo and normal of the first surface that is not a mirror or glass, or else of the first one; position of the
/// first one.
enum class GuideKind { kAlbedo, kNormal, kPosition };

/// The guide layer of the image at `path` by the renderers' names (table in docs/other-renderers.md); if there are
/// several, the first in the table. An albedo is converted to `colours`, the picture's space. `picture`: the picture's
/// layer, to which layers of other views do not belong. Throws like read_image() and check_guide().
std::optional<Image> find_guide(const std::string& path, const ImageInfo& info, GuideKind kind,
                                const ColourSpace& colours, const std::string& picture = "");

/// A guide named by the user: a layer of the image at `path`, or a separate file, whose frame must have the same size;
/// of a larger data window, the pixels of the image. An albedo is converted to `colours`. Throws like read_image(),
/// check_guide() and common_window().
Image named_guide(const std::string& path, const ImageInfo& info, GuideKind kind, const ColourSpace& colours,
                  const std::string& layer_or_file);

}  // namespace covary
