// SPDX-License-Identifier: Apache-2.0
#include "imageio/exr_picture.h"

#include <gtest/gtest.h>

#include "core/error.h"

namespace covary {
namespace {

ExrPart part(const std::string& name, const std::vector<std::string>& channels, bool deep = false) {
  ExrPart result{name, {}, deep};
  for (const std::string& channel : channels) result.channels.push_back({channel, channel == "RY" || channel == "BY"});
  return result;
}

/// "part: channels", or the error.
std::string picture_of(const std::vector<ExrPart>& parts) {
  try {
    const ExrPicture picture = find_exr_picture(parts, "a.exr");
    std::string text = std::to_string(picture.part) + ":";
    for (const std::string& channel : picture.channels) text += " " + channel;
    return text;
  } catch (const Error& error) {
    return error.what();
  }
}

TEST(ExrPicture, IsTheColoursWithoutALayer) {
  EXPECT_EQ(picture_of({part("", {"A", "B", "G", "R", "Y", "diffuse.B", "diffuse.G", "diffuse.R"})}), "0: R G B");
  EXPECT_EQ(picture_of({part("", {"a", "b", "g", "r"})}), "0: r g b");
  EXPECT_EQ(picture_of({part("", {"blue", "green", "red"})}), "0: red green blue");
  EXPECT_EQ(picture_of({part("depth", {"Z"}), part("anything", {"B", "G", "R"})}), "1: R G B");
  EXPECT_EQ(picture_of({part("diffuse", {"B", "G", "R"}), part("rgba", {"A", "B", "G", "R"})}), "1: R G B");
  EXPECT_EQ(picture_of({part("deep", {"B", "G", "R"}, true), part("flat", {"B", "G", "R"})}), "1: R G B");
}

TEST(ExrPicture, IsElseThoseOfALayer) {
  EXPECT_EQ(picture_of({part("", {"glow.B", "glow.G", "glow.R", "depth.Z"})}), "0: glow.R glow.G glow.B");
  EXPECT_EQ(picture_of({part("", {"View.Combined.B", "View.Combined.G", "View.Combined.R", "View.Dir.B", "View.Dir.G",
                                  "View.Dir.R"})}),
            "0: View.Combined.R View.Combined.G View.Combined.B");
  EXPECT_EQ(picture_of({part("Depth", {"Depth.V"}), part("View", {"Image.B", "Image.G", "Image.R"})}),
            "1: Image.R Image.G Image.B");
}

TEST(ExrPicture, IsElseGrey) {
  EXPECT_EQ(picture_of({part("", {"A", "Y"})}), "0: Y");
  EXPECT_EQ(picture_of({part("", {"Y", "glow.B", "glow.G", "glow.R"})}), "0: Y");
  EXPECT_EQ(picture_of({part("", {"Z"})}), "0: Z");
  EXPECT_EQ(picture_of({part("", {"A", "Z"})}), "0: Z");
  EXPECT_EQ(picture_of({part("", {"G", "R"})}), "0: R");
  EXPECT_EQ(picture_of({part("depth", {"Z"}), part("grey", {"Y"})}), "1: Y");
}

TEST(ExrPicture, IsElseAnErrorThatListsWhatThereIs) {
  const std::string needs = "; a texture needs R, G, B or a grey one";
  EXPECT_EQ(picture_of({part("", {"A"})}), "a.exr has the channels A" + needs);
  EXPECT_EQ(picture_of({part("", {"BY", "RY", "Y"})}), "a.exr has the channels BY, RY, Y" + needs);
  EXPECT_EQ(picture_of({part("", {"N.X", "N.Y", "N.Z"})}), "a.exr has the channels N.X, N.Y, N.Z" + needs);
  EXPECT_EQ(picture_of({part("depth", {"Z"}), part("id", {"id"}), part("c", {"R", "G", "B"}, true)}),
            "a.exr has the parts 'depth' (Z), 'id' (id), 'c' (R, G, B, deep)" + needs);
  const std::string one = " 2 pictures; a texture needs one, or one named 'beauty' or 'rgba'";
  EXPECT_EQ(picture_of({part("left", {"B", "G", "R"}), part("right", {"B", "G", "R"})}),
            "a.exr has the parts 'left' (B, G, R), 'right' (B, G, R):" + one);
  EXPECT_EQ(picture_of({part("", {"a.B", "a.G", "a.R", "b.B", "b.G", "b.R"})}),
            "a.exr has the channels a.B, a.G, a.R, b.B, b.G, b.R:" + one);
}

}  // namespace
}  // namespace covary
