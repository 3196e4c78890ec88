// SPDX-License-Identifier: Apache-2.0
// What files say of where their images come from, and what that means for comparing them.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "film/image_file.h"

namespace covary {

/// Attribute: stops that `covary convert --exposure` changed the image by.
inline constexpr const char* kExposureAttribute = "covary:exposure";

/// The attributes of covary that stay true of an image that is made from this one: those of films as such are left out.
std::map<std::string, std::string> inherited_attributes(const std::map<std::string, std::string>& attributes);

struct ImageFacts {
  std::string path, name;  ///< name: for messages
  ImageInfo info;
};

/// Throws like inspect_image(). `name`: "" stands for the path.
ImageFacts read_facts(const std::string& path, const std::string& name = "");

/// Reasons, by the files' attributes and types, why errors of `image` against `reference` are not what they seem: one
/// file given as both, seeds in common (the images share samples), another scene, settings, pixel filter, exposure,
/// integers against floating point. A file that does not tell is not suspected. Empty: none is known.
std::vector<std::string> comparison_warnings(const ImageFacts& image, const ImageFacts& reference);

/// Reasons why the image is not the picture of its scene that it seems: a film whose light film is missing, a light
/// film alone, an interrupted render.
std::vector<std::string> image_warnings(const ImageFacts& image);

/// Reasons why errors of `image` against `reference` alone are those of the reference, too: it is denoised, or has no
/// more samples. Both halves of a reference have noise of their own, which cancels.
std::vector<std::string> reference_warnings(const ImageFacts& image, const ImageFacts& reference);

}  // namespace covary
