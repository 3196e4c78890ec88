// SPDX-License-Identifier: Apache-2.0
// What files record about the origin of their images, and what that means for comparing them.
#pragma once

#include <map>
#include <span>
#include <string>
#include <vector>

#include "film/image_file.h"

namespace covary {

/// Attribute: exposure in stops applied by `covary convert --exposure`.
inline constexpr const char* kExposureAttribute = "covary:exposure";

/// covary's attributes that remain true for an image made of those of all these files: what rendered their samples.
/// Seeds are joined; others that differ, and those that describe the old image (its error, its estimator, its place in
/// a film), are dropped.
std::map<std::string, std::string> inherited_attributes(std::span<const std::map<std::string, std::string>> files);
/// Of files; those that are not EXR have none.
std::map<std::string, std::string> inherited_attributes(std::span<const std::string> paths);

struct ImageFacts {
  std::string path, name;  ///< `name` is used in messages
  ImageInfo info;
};

/// Throws like inspect_image(). `name`: "" means the path.
ImageFacts read_facts(const std::string& path, const std::string& name = "");

/// Reasons, from the files' attributes and types, why errors of `image` against `reference` are misleading: the same
/// file given twice, common seeds (the images share samples), different scene, settings, pixel filter or exposure,
/// integers against floating point. Missing attributes cause no warning. Empty if there is none.
std::vector<std::string> comparison_warnings(const ImageFacts& image, const ImageFacts& reference);

/// Reasons why the image is not the full picture of its scene: a film without its light film, a light film alone, an
/// interrupted render.
std::vector<std::string> image_warnings(const ImageFacts& image);

/// Reasons why errors of `image` against a single `reference` include the reference's own: it is denoised, has no more
/// samples than the image, or an error that is not small beside the image's. With two halves of a reference, their
/// noise cancels; `may_have_two`: the caller can take them, so that an unknown error is a reason, too.
std::vector<std::string> reference_warnings(const ImageFacts& image, const ImageFacts& reference, bool may_have_two);

}  // namespace covary
