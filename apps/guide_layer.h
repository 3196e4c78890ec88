// SPDX-License-Identifier: Apache-2.0
// Layers of an image that guide a denoiser, by the names that renderers give them.
#pragma once

#include <optional>
#include <string>

#include "film/image_file.h"

namespace covary {

/// Albedo and normal of the first surface that is not a mirror or glass, or of the first one.
enum class GuideKind { kAlbedo, kNormal };

/// The layer of the image at `path` that some renderer calls so (docs/other-renderers.md has the table); where several
/// do, the first of the table. Throws as read_image() and check_guide().
std::optional<Image> find_guide(const std::string& path, const ImageInfo& info, GuideKind kind);

/// A guide that the user names: a layer of the image at `path`, or a file of its own. Throws as read_image() and
/// check_guide().
Image named_guide(const std::string& path, const ImageInfo& info, const std::string& layer_or_file);

}  // namespace covary
