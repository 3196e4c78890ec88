// SPDX-License-Identifier: Apache-2.0
// Warnings of shapes that floats cannot tell from a sheet where they stand. At 1e5 floats are 1/128 apart, so that 20
// of these spacings are 0.16.
#include "io/thin_shapes.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include "io/load_scene.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::contains;

/// A pane of this thickness and a small and a large ball, at this distance from the origin.
std::vector<std::string> warnings_at(double distance, double thickness) {
  return load_scene_text(
             fmt::format("<scene version='3.0.0'>\n<sensor type='perspective'/>\n<shape type='cube'><transform "
                         "name='to_world'><scale x='1' y='1' z='{}'/><translate x='{}'/></transform></shape>\n"
                         "<shape type='sphere'><float name='radius' value='{}'/><point name='center' value='{}, 4, "
                         "0'/></shape>\n<shape type='sphere'><point name='center' value='{}, 8, 0'/></shape></scene>",
                         thickness / 2, distance, thickness / 2, distance, distance),
             "thin.xml")
      .warnings;
}

TEST(ThinShapes, AreNamedWithTheirThicknessAndPlace) {
  const std::vector<std::string> warnings = warnings_at(1e5, 0.125);
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_TRUE(contains(warnings[0], "thin.xml:3:1: shape 'cube' is 0.12 thick at (100000"));
  EXPECT_TRUE(contains(warnings[0],
                       "where floats are 0.0078 apart: light that passes it may be wrong; expected at "
                       "least 0.16, or a place nearer to the origin"));
  EXPECT_TRUE(contains(warnings[1], "thin.xml:4:1: shape 'sphere' is 0.1"));
}

/// Of two cubes that meet, behind the faces of the one that light passes, rays may start beyond those of the other. At
/// 1e5, 640 spacings are 5; the diagonals are 1.7 and 6.9.
TEST(ThinShapes, AreNamedIfTheyAreSmallAndLightPassesThem) {
  const auto warnings = [](const char* model, double size) {
    return load_scene_text(fmt::format("<scene version='3.0.0'>\n<sensor type='perspective'/>\n<shape type='cube'>"
                                       "<transform name='to_world'><scale value='{}'/><translate x='1e5'/></transform>"
                                       "<bsdf type='{}'/></shape></scene>",
                                       size / 2, model),
                           "small.xml")
        .warnings;
  };
  for (const char* model : {"null", "dielectric", "thindielectric"}) {
    const std::vector<std::string> small = warnings(model, 1);
    ASSERT_EQ(small.size(), 1u) << model;
    EXPECT_TRUE(contains(small[0],
                         "small.xml:3:1: shape 'cube' is 1.7 across at (100000, 0, 0), where floats are 0.0078 "
                         "apart: light that passes it where it meets other surfaces may be wrong; expected "
                         "at least 5,"))
        << small[0];
    EXPECT_TRUE(warnings(model, 4).empty()) << model;
  }
  EXPECT_TRUE(warnings("diffuse", 1).empty());
}

TEST(ThinShapes, AreNotSuspectedWhereFloatsAreFineEnough) {
  EXPECT_TRUE(warnings_at(0, 0.125).empty());
  EXPECT_TRUE(warnings_at(1000, 0.125).empty());
  EXPECT_TRUE(warnings_at(1e5, 0.5).empty());
  EXPECT_TRUE(warnings_at(0, 1e-3).empty());
}

}  // namespace
}  // namespace covary
