// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "textures/image.h"

namespace covary {

/// An image that stands in a scene's own file (scene/embedded_data.h): binary PGM or PPM of 8 bits, which have sRGB
/// values, or PFM of little-endian floats. Throws Error(kInput) for anything else, and for values that are not finite.
TexelImage read_embedded_image(std::string_view bytes);

}  // namespace covary
