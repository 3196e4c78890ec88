// SPDX-License-Identifier: Apache-2.0
// Conversion between colour spaces, against published matrices.
#include "film/colour_space.h"

#include <gtest/gtest.h>

#include "support/files.h"

namespace covary {
namespace {

using test_support::contains, test_support::message_of;

const ColourSpace kAcesCg{{0.713f, 0.293f}, {0.165f, 0.83f}, {0.128f, 0.044f}, {0.32168f, 0.33767f}};

void expect_matrix(const RgbMatrix& matrix, const RgbMatrix& expected, double tolerance) {
  for (size_t row = 0; row < 3; ++row)
    for (size_t column = 0; column < 3; ++column)
      EXPECT_NEAR(matrix[row][column], expected[row][column], tolerance) << row << ' ' << column;
}

TEST(ColourSpace, MatricesArePublishedOnes) {
  // ITU-R BT.709 to CIE XYZ, in the four digits of its derivation by SMPTE RP 177.
  expect_matrix(colour_conversion(ColourSpace::rec709(), ColourSpace::xyz()),
                {{{0.4124, 0.3576, 0.1805}, {0.2126, 0.7152, 0.0722}, {0.0193, 0.1192, 0.9505}}}, 6e-5);
  // ACEScg to Rec. 709 with Bradford's adaptation, as in OpenColorIO's ACES configurations.
  expect_matrix(colour_conversion(kAcesCg, ColourSpace::rec709()),
                {{{1.70505, -0.62179, -0.08326}, {-0.13026, 1.14080, -0.01055}, {-0.02400, -0.12897, 1.15297}}}, 2e-5);
}

TEST(ColourSpace, WhiteStaysWhite) {
  for (const ColourSpace& to : {ColourSpace::rec709(), aces_colour_space()}) {
    Image image(1, 1, 3);
    image.data = {0.5f, 0.5f, 0.5f};
    convert_colours(colour_conversion(kAcesCg, to), image);
    for (const float value : image.data) EXPECT_NEAR(value, 0.5, 1e-6);
  }
}

TEST(ColourSpace, XyzIsNotAdapted) {
  Image image(1, 1, 3);
  const double x = 0.3127, y = 0.329;
  image.data = {static_cast<float>(x / y), 1, static_cast<float>((1 - x - y) / y)};  // the white of Rec. 709
  convert_colours(colour_conversion(ColourSpace::xyz(), ColourSpace::rec709()), image);
  for (const float value : image.data) EXPECT_NEAR(value, 1, 1e-6);
}

TEST(ColourSpace, IsKnownByNameOrNumbers) {
  EXPECT_EQ(ColourSpace().text(), "Rec. 709");
  EXPECT_EQ(kAcesCg.text(), "ACEScg");
  EXPECT_EQ(aces_colour_space().text(), "ACES2065-1");
  ColourSpace other;
  other.blue = {0.2f, 0.1f};
  EXPECT_EQ(other.text(), "primaries (0.64, 0.33), (0.3, 0.6), (0.2, 0.1), white (0.3127, 0.329)");
  EXPECT_EQ(named_colour_space({{"colorInteropID", "lin_ap1_scene"}}), kAcesCg);
  EXPECT_EQ(named_colour_space({{"oiio:ColorSpace", "ACES2065-1"}}), aces_colour_space());
  EXPECT_EQ(named_colour_space({{"oiio:ColorSpace", "show_working_space"}}), ColourSpace::rec709());
}

TEST(ColourSpace, PrimariesOnALineAreRefused) {
  ColourSpace flat;
  flat.blue = flat.red;
  EXPECT_TRUE(contains(message_of([&] { colour_conversion(flat, ColourSpace::rec709()); }, ErrorCode::kInput),
                       "primaries lie on a line"));
}

}  // namespace
}  // namespace covary
