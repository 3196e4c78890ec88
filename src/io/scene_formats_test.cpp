// SPDX-License-Identifier: Apache-2.0
#include "io/scene_formats.h"

#include <gtest/gtest.h>

#include <set>

namespace covary {
namespace {

TEST(SceneFormats, FilesBelongToOne) {
  std::set<std::string_view> endings;
  for (const SceneFormat& format : scene_formats())
    for (const std::string_view ending : format.endings) {
      EXPECT_TRUE(endings.insert(ending).second) << ending;
      const std::string name = "a" + std::string(ending);
      EXPECT_TRUE(is_scene_file(name)) << name;
      EXPECT_EQ(&scene_format_of(name), &format) << name;
    }
  EXPECT_FALSE(is_scene_file("a.exr"));
  EXPECT_STREQ(scene_format_of("a").name, "Mitsuba XML");
}

TEST(SceneFormats, AreNamedInHelp) {
  EXPECT_EQ(scene_format_names(), "Mitsuba XML, pbrt or glTF");
  EXPECT_EQ(scene_format_names(", "), "Mitsuba XML, pbrt, glTF");
  EXPECT_EQ(scene_file_endings(), ".xml, .pbrt, .glb, .gltf");
}

}  // namespace
}  // namespace covary
