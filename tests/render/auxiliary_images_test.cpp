// SPDX-License-Identifier: Apache-2.0
// Auxiliary images show the first hit; those for denoisers, what is seen in mirrors and through glass.
#include "integrators/aov.h"

#include "render_fixture.h"

namespace covary {
namespace {

constexpr int kSide = 8;
constexpr uint32_t kSamples = 16;

/// A square with sides of 200, perpendicular to the z axis; `turned`: faces +z instead of -z.
std::string wall(double z, const std::string& bsdf, bool turned = false) {
  return "<shape type='rectangle'><transform name='to_world'><scale value='100'/>" +
         std::string(turned ? "" : "<rotate y='1' angle='180'/>") + "<translate z='" + std::to_string(z) +
         "'/></transform>" + bsdf + "</shape>";
}
std::string diffuse(const std::string& colour) {
  return "<bsdf type='diffuse'><rgb name='reflectance' value='" + colour + "'/></bsdf>";
}
std::string mirror(const std::string& colour) {
  return "<bsdf type='conductor'><string name='material' value='none'/><rgb name='specular_reflectance' value='" +
         colour + "'/></bsdf>";
}
const std::string kPane = "<bsdf type='thindielectric'/>";

std::map<std::string, Image> images_of(const std::string& body, uint32_t most = kSamples) {
  const TestScene scene = load_text(scene_text(body, kSide, kSide));
  Film film = new_film(scene);
  PassSettings settings;
  settings.filter = scene.loaded.filter;
  render_aovs(scene.scene(), settings, most, film);
  return film.aovs;
}

void expect_constant(const Image& image, const Vec3& value) {
  for (int y = 0; y < image.height; ++y)
    for (int x = 0; x < image.width; ++x)
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(image.pixel(x, y)[c], value[c], 1e-5) << x << ", " << y << ", " << c;
}

TEST(AuxiliaryImages, HaveTheirNames) {
  const std::map<std::string, Image> images = images_of(wall(5, diffuse("0.2")));
  EXPECT_EQ(images.size(), kAuxiliaryFeatures.size());
  for (const AuxiliaryFeature& feature : kAuxiliaryFeatures)
    EXPECT_EQ(images.at(feature.layer).data.size(), 3u * kSide * kSide) << feature.layer;
}

TEST(AuxiliaryImages, WithoutMirrorsBothKindsHaveTheSameBits) {
  const auto images = images_of(wall(5, diffuse("0.2, 0.5, 0.8")));
  EXPECT_EQ(images.at("DenoisingAlbedo").data, images.at("Albedo").data);
  EXPECT_EQ(images.at("DenoisingNormal").data, images.at("N").data);
  expect_constant(images.at("Albedo"), {0.2f, 0.5f, 0.8f});
  expect_constant(images.at("N"), {0, 0, -1});
}

// The largest error of the albedo where a dark wall occludes half of a bright one.
double largest_error(uint32_t most, double edge) {
  const std::string half =
      "<shape type='rectangle'><transform name='to_world'><rotate y='1' angle='180'/><translate "
      "x='" +
      std::to_string(1 + edge) + "' z='4'/></transform>" + diffuse("0.1") + "</shape>";
  const Image albedo = images_of(half + wall(5, diffuse("0.9")), most).at("Albedo");
  const Image exact = images_of(half + wall(5, diffuse("0.9")), 1 << 14).at("Albedo");
  double largest = 0;
  for (size_t i = 0; i < albedo.data.size(); ++i)
    largest = std::max(largest, std::abs(double{albedo.data[i]} - exact.data[i]));
  return largest;
}

// With 64 independent samples, the 20 pixels or so along the edge would have errors of up to 0.1.
TEST(AuxiliaryImages, EdgesAreExactWithFewSamples) { EXPECT_LT(largest_error(64, 0.03), 0.04); }

TEST(AuxiliaryImages, AMirrorShowsWhatItReflectsInItsColour) {
  const auto images = images_of(wall(5, mirror("0.5, 0.25, 1")) + wall(-5, diffuse("0.2, 0.4, 0.8"), true));
  expect_constant(images.at("Albedo"), {0.5f, 0.25f, 1});
  expect_constant(images.at("N"), {0, 0, -1});
  expect_constant(images.at("DenoisingAlbedo"), {0.1f, 0.1f, 0.8f});
  expect_constant(images.at("DenoisingNormal"), {0, 0, 1});
}

// A wall of the same colour is behind the pane and reflected in it, so it does not matter which event is sampled.
TEST(AuxiliaryImages, APaneShowsTheWallBehind) {
  const auto images =
      images_of(wall(3, kPane) + wall(5, diffuse("0.2, 0.4, 0.8")) + wall(-5, diffuse("0.2, 0.4, 0.8"), true));
  expect_constant(images.at("DenoisingAlbedo"), {0.2f, 0.4f, 0.8f});
}

TEST(AuxiliaryImages, WhatShinesIsDarkAlsoInMirrors) {
  const auto lamp = [](const char* radiance) {
    return diffuse("0.8, 0.4, 0.4") + "<emitter type='area'><rgb name='radiance' value='" + radiance + "'/></emitter>";
  };
  expect_constant(images_of(wall(5, lamp("0.2, 0.8, 0"))).at("Albedo"), {0.4f, 0.2f, 0.2f});
  const auto images = images_of(wall(5, mirror("0.5")) + wall(-5, lamp("800"), true));
  expect_constant(images.at("DenoisingAlbedo"), {0, 0, 0});
  expect_constant(images.at("Albedo"), {0.5f, 0.5f, 0.5f});
  expect_constant(images_of(wall(5, lamp("800"), true)).at("Albedo"), {0.8f, 0.4f, 0.4f});  // its dark side
}

TEST(AuxiliaryImages, AMirrorOfTheSkyIsEmpty) {
  const auto images = images_of(wall(5, mirror("1")));
  expect_constant(images.at("DenoisingAlbedo"), {0, 0, 0});
  expect_constant(images.at("DenoisingNormal"), {0, 0, 0});
  expect_constant(images.at("Albedo"), {1, 1, 1});
}

// Between two parallel mirrors, paths end after kFollowedBounces.
TEST(AuxiliaryImages, ParallelMirrorsEndTheWay) {
  const auto images = images_of(wall(5, mirror("0.5")) + wall(-5, mirror("0.5"), true));
  const auto expected = static_cast<float>(std::pow(0.5, kFollowedBounces + 1));
  expect_constant(images.at("DenoisingAlbedo"), {expected, expected, expected});
}

}  // namespace
}  // namespace covary
