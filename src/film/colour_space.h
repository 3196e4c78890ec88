// SPDX-License-Identifier: Apache-2.0
// Colour spaces of linear RGB images: primaries and white, as the attribute `chromaticities` of EXR files gives them.
#pragma once

#include <array>
#include <map>
#include <string>

#include "film/film.h"

namespace covary {

/// Linear RGB by the CIE 1931 x, y of its primaries and its white; without more, Rec. 709, in which covary computes and
/// which EXR files without `chromaticities` have.
struct ColourSpace {
  struct Point {
    float x = 0, y = 0;
  };
  Point red{0.64f, 0.33f}, green{0.3f, 0.6f}, blue{0.15f, 0.06f}, white{0.3127f, 0.329f};

  static ColourSpace rec709() { return {}; }
  /// CIE XYZ: the three channels are X, Y and Z.
  static ColourSpace xyz() { return {{1, 0}, {0, 1}, {0, 0}, {1 / 3.0f, 1 / 3.0f}}; }
  /// Same primaries and white, to within the rounding of published values.
  bool operator==(const ColourSpace& other) const;
  /// "Rec. 709", "ACEScg", …; otherwise the numbers.
  std::string text() const;
};

/// The space that text attributes of a file name (colorInteropID of OpenEXR 3.4, oiio:ColorSpace); Rec. 709 if they
/// name none that is known here: most such names mean something only with a configuration that the file lacks.
ColourSpace named_colour_space(const std::map<std::string, std::string>& attributes);

/// ACES2065-1, the space of ACES containers (SMPTE ST 2065-4).
ColourSpace aces_colour_space();

/// Factors [to][from]. Whites are adapted by Bradford's transformation; CIE XYZ has no white of its own, so colours
/// move to and from it unchanged.
using RgbMatrix = std::array<std::array<double, 3>, 3>;
/// Throws Error(kInput) if the primaries of either span no colours.
RgbMatrix colour_conversion(const ColourSpace& from, const ColourSpace& to);

/// Multiplies all colours; 3 channels.
void convert_colours(const RgbMatrix& matrix, Image& image);

}  // namespace covary
