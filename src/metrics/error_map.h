// SPDX-License-Identifier: Apache-2.0
// Per-pixel errors as colours: from black over violet, red and orange to pale yellow, lightness rising evenly.
#pragma once

#include <cstdint>
#include <span>
#include <string>

#include "film/film.h"

namespace covary {

/// Which errors the ends of the colour scale stand for.
struct ErrorScale {
  double low = 0, high = 1;
  bool logarithmic = false;
  /// "0.001 black, …, 10 pale yellow": the values at the quarters of the scale.
  std::string legend() const;
};

/// The whole powers of ten around the middle 98 % of the positive errors in all maps, one to eight decades.
ErrorScale decade_scale(std::span<const Image> maps);

/// The colours of the scale from low to high, as 0xRRGGBB in sRGB, evenly spaced.
std::span<const uint32_t> error_colours();

/// Linear RGB for write_png; errors beyond the scale take its end colours, not-a-number is green.
Image colour_errors(const Image& map, const ErrorScale& scale);

}  // namespace covary
