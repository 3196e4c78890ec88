// SPDX-License-Identifier: Apache-2.0
#include "combine/beauty_layers.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace covary::beauty_layers_test {
namespace {

std::string found(const std::vector<std::string>& layers) {
  std::vector<ExrFile::Channel> channels;
  for (const std::string& layer : layers)
    for (const char c : {'R', 'G', 'B'}) channels.push_back({(layer.empty() ? "" : layer + ".") + c, "float", ""});
  std::string text;
  for (const BeautyLayer& l : find_beauty_layers(find_pictures(channels)[0], channels))
    text += fmt::format("{} {}{}{}\n", l.sum, l.name, l.colour.empty() ? "" : " x ", l.colour);
  return text;
}

TEST(BeautyLayers, OfBlender) {
  EXPECT_EQ(found({"V.Combined", "V.Combined_key", "V.DiffDir", "V.DiffInd", "V.DiffCol", "V.GlossDir", "V.Emit",
                   "V.AO", "W.Combined_key"}),
            "lights V.Combined_key\ncomponents V.DiffDir x V.DiffCol\ncomponents V.DiffInd x V.DiffCol\n"
            "components V.Emit\n")
      << "light whose colour is missing, and layers of other kinds and view layers, are left";
  EXPECT_EQ(found({"V.Combined", "V.Diffuse Direct", "V.Diffuse Color", "V.Emission"}),
            "components V.Diffuse Direct x V.Diffuse Color\ncomponents V.Emission\n");
}

TEST(BeautyLayers, OfArnold) {
  EXPECT_EQ(found({"", "RGBA_key", "diffuse", "diffuse_direct", "diffuse_indirect", "coat", "direct", "emission"}),
            "lights RGBA_key\ncomponents diffuse_direct\ncomponents diffuse_indirect\ncomponents coat\ndirect direct\n"
            "components emission\n");
  EXPECT_EQ(found({"", "direct", "indirect", "background"}), "direct direct\ndirect indirect\ndirect background\n");
  EXPECT_EQ(found({"", "albedo", "emission"}), "");
}

}  // namespace
}  // namespace covary::beauty_layers_test
