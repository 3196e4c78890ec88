// SPDX-License-Identifier: Apache-2.0
// What a file says about whether its picture was denoised.
#pragma once

#include <map>
#include <span>
#include <string>

#include "film/exr.h"

namespace covary {

/// How the picture was denoised, for messages; "" if the file does not say. covary names the denoiser in attributes,
/// Cycles writes a layer `Noisy Image` beside denoised pictures. `layer`: the image in the file that is meant, "" for
/// the picture.
std::string denoised_by(const std::map<std::string, std::string>& attributes,
                        std::span<const ExrFile::Channel> channels, const std::string& layer = "");

}  // namespace covary
