// SPDX-License-Identifier: Apache-2.0
// False-colour maps of per-pixel errors: black, violet, red, orange, pale yellow, with linearly rising lightness.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "film/film.h"

namespace covary {

/// The errors at the ends of the colour scale.
struct ErrorScale {
  double low = 0, high = 1;
  bool logarithmic = false;
  /// "0.001 black, …, 10 pale yellow": values at the quarters of the scale.
  std::string legend() const;
};

/// Powers of ten around the middle 98 % of the positive errors in all maps; one to eight decades.
ErrorScale decade_scale(std::span<const Image> maps);

/// Evenly spaced colours of the scale from low to high, as 0xRRGGBB in sRGB.
std::span<const uint32_t> error_colours();

/// Linear RGB for write_png(). Errors beyond the scale take its end colours; NaN is green.
Image colour_errors(const Image& map, const ErrorScale& scale);

}  // namespace covary
