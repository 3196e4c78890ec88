// SPDX-License-Identifier: Apache-2.0
// The channels are those of files of the renderers named.
#include "film/pictures.h"

#include <gtest/gtest.h>

namespace covary::pictures_test {
namespace {

using Channels = std::vector<ExrFile::Channel>;

/// Channels R, G, B of these layers; "Z:N" for X, Y, Z of N.
Channels layers(const std::vector<std::string>& names, const std::vector<std::string>& views = {}) {
  Channels channels;
  for (const std::string& name : names) {
    const bool is_vector = name.starts_with("Z:");
    const std::string layer = is_vector ? name.substr(2) : name;
    std::string view;
    for (const std::string& v : views)
      if (("." + layer + ".").find("." + v + ".") != std::string::npos) view = v;
    if (view.empty() && !views.empty() && layer.empty()) view = views[0];
    for (const char c : std::string(is_vector ? "XYZ" : "RGB"))
      channels.push_back({(layer.empty() ? "" : layer + ".") + c, "float", view});
  }
  return channels;
}

std::string pictures(const Channels& channels) { return text_of(find_pictures(channels)); }

TEST(Pictures, AreFoundByTheNamesOfRenderers) {
  EXPECT_EQ(pictures(layers({"", "albedo", "group00", "Z:N"})), "R G B");
  EXPECT_EQ(pictures(layers({"ViewLayer.Combined", "ViewLayer.Combined_light1", "ViewLayer.CryptoObject00",
                             "ViewLayer.CryptoObject01", "Z:ViewLayer.Normal"})),
            "'ViewLayer.Combined'");
  EXPECT_EQ(pictures(layers({"ViewLayer.Combined", "ViewLayer.Noisy Image"})), "'ViewLayer.Combined'");
  EXPECT_EQ(pictures(layers({"ViewLayer.Noisy Image", "ViewLayer.Denoising Albedo"})), "'ViewLayer.Noisy Image'");
  EXPECT_EQ(pictures(layers({"Composite.Combined", "ViewLayer.Combined"})), "'ViewLayer.Combined'");
  EXPECT_EQ(pictures(layers({"Ci", "albedo"})), "'Ci'") << "RenderMan";
  EXPECT_EQ(pictures(layers({"C", "albedo", "crypto_object00"})), "'C'") << "Karma";
  EXPECT_EQ(pictures(layers({"rgba", "diffuse"})), "'rgba'");
  EXPECT_EQ(pictures(layers({"default", "diffuse"})), "'default'");
  EXPECT_EQ(pictures(layers({"beauty", "uCryptoObject00"})), "'beauty'");
  EXPECT_EQ(pictures(layers({"light", "uCryptoObject00", "uCryptoObject01"})), "'light'") << "the only colours";
  EXPECT_EQ(pictures(layers({"light", "StdError", "Bias"})), "'light'") << "a result of denoise";
  EXPECT_EQ(pictures(layers({"ambient", "diffuse"})), "");
  EXPECT_EQ(pictures({{"Y", "half", ""}}), "R G B") << "grey has no name, either";
  EXPECT_EQ(pictures({{"Y", "half", ""}, {"RY", "half", ""}, {"BY", "half", ""}}), "");
}

TEST(Pictures, OfViewsAndViewLayersAreSeveral) {
  const std::vector<std::string> views = {"left", "right"};
  EXPECT_EQ(pictures(layers({"ViewLayer.Combined", "Second.Combined"})), "'ViewLayer.Combined', 'Second.Combined'");
  const Channels blender =
      layers({"ViewLayer.Combined.left", "ViewLayer.Combined.right", "ViewLayer.Denoising Albedo.left"}, views);
  EXPECT_EQ(pictures(blender), "'ViewLayer.Combined.left', 'ViewLayer.Combined.right'");
  EXPECT_EQ(pictures(layers({"", "right"}, views)), "R G B, 'right'") << "OpenEXR's first view has no name";
  EXPECT_EQ(pictures(layers({"rgba.left", "rgba.right", "depth.left"}, views)), "'rgba.left', 'rgba.right'") << "Nuke";
  EXPECT_EQ(without_view("rgba_left", "left"), "rgba") << "parts of OpenEXR's Beachball";
  EXPECT_EQ(without_view("a.left.b", "left"), "a.b");

  EXPECT_EQ(chosen_layer("f", blender, {"", "right"}), "ViewLayer.Combined.right");
  EXPECT_EQ(chosen_layer("f", blender, {"ViewLayer", "left"}), "ViewLayer.Combined.left");
  EXPECT_EQ(chosen_layer("f", blender, {"ViewLayer.Combined", "left"}), "ViewLayer.Combined.left");
  EXPECT_EQ(text_of(chosen_pictures("f", blender, {"", "all"})), pictures(blender));
  const Channels two = layers({"ViewLayer.Combined", "Second.Combined", "Second.Emit"});
  EXPECT_EQ(chosen_layer("f", two, {"Second", ""}), "Second.Combined");
  EXPECT_EQ(chosen_layer("f", two, {"Second.Emit", ""}), "Second.Emit");
}

TEST(Pictures, ThatAreNotThereAreToldWithThoseThatAre) {
  const Channels stereo = layers({"left", "right"}, {"left", "right"});
  const auto message = [&](const PictureChoice& choice) -> std::string {
    try {
      return chosen_layer("f.exr", stereo, choice);
    } catch (const Error& error) {
      return error.what();
    }
  };
  EXPECT_EQ(message({"", "middle"}), "f.exr: no picture of the view 'middle'; its views: 'left', 'right'");
  EXPECT_EQ(message({"", "all"}), "f.exr: several pictures, 'left', 'right'; choose one by --view or --layer");
  EXPECT_EQ(message({"lift", ""}),
            "f.exr: no layer 'lift'; did you mean 'left'? (layers: left, right; channels: left.R left.G left.B right.R "
            "right.G right.B)");
}

TEST(Pictures, HaveTheirOwnFeatures) {
  const Channels channels = layers({"left", "right", "left.albedo", "right.albedo", "albedo"}, {"left", "right"});
  const Picture left = chosen_pictures("f", channels, {"", "left"})[0];
  EXPECT_TRUE(belongs_to(left, "left.albedo", channels));
  EXPECT_TRUE(belongs_to(left, "albedo", channels));
  EXPECT_FALSE(belongs_to(left, "right.albedo", channels));
  const Channels two = layers({"ViewLayer.Combined", "Second.Combined", "Second.Denoising Albedo"});
  EXPECT_FALSE(belongs_to(find_pictures(two)[0], "Second.Denoising Albedo", two));
  EXPECT_TRUE(belongs_to(find_pictures(two)[1], "Second.Denoising Albedo", two));
  const Channels cycles = layers({"L.Combined", "L.Noisy Image", "M.Combined"});
  EXPECT_EQ(noisy_layer(find_pictures(cycles)[0], cycles), "L.Noisy Image");
  EXPECT_EQ(noisy_layer(find_pictures(cycles)[1], cycles), "");
}

}  // namespace
}  // namespace covary::pictures_test
