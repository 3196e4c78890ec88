// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "film/grouped_image.h"

namespace covary {

/// Samples of each pixel relative to the image's mean, row by row; empty if all pixels have the same number.
std::vector<float> relative_counts(const GroupedImage& image);

}  // namespace covary
