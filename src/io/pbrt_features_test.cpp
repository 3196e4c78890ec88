// SPDX-License-Identifier: Apache-2.0
// What other programs write in pbrt-v4 files. Expected values come from pbrt's definitions: formulas of its shapes,
// textures, lights and media, named with each test.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <fstream>

#include "io/load_scene.h"
#include "support/files.h"
#include "support/pbrt_scenes.h"

namespace covary::pbrt_features_test {
namespace {

using test_support::contains;
using test_support::message_of;

class PbrtFeatures : public test_support::PbrtScenes {};

/// cameras.cpp: the image plane at distance 1 is the window times tan(fov / 2).
TEST_F(PbrtFeatures, ScreenWindowsPlaceTheImage) {
  for (const char* lens : {"", "\"float lensradius\" 0.1 \"float focaldistance\" 5"}) {
    const LoadedScene scene = load(R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 20
Camera "perspective" "float fov" 60 "float screenwindow" [ -0.5 1.5 -0.25 0.75 ] )" +
                                   std::string(lens) + "\nWorldBegin\n");
    const float t = std::tan(kPi / 6);
    const auto expect = [&](Vec2 film, Vec2 window) {
      const Ray ray = scene.scene->camera().ray(film, {0.5f, 0.5f});
      EXPECT_NEAR(ray.d.x / ray.d.z, window.x * t, 1e-4f) << lens;
      EXPECT_NEAR(ray.d.y / ray.d.z, window.y * t, 1e-4f) << lens;
    };
    expect({0, 0}, {-0.5f, 0.75f});
    expect({40, 20}, {1.5f, -0.25f});
  }
  const LoadedScene parallel = load(R"(Film "rgb" "integer xresolution" 40 "integer yresolution" 20
Camera "orthographic" "float screenwindow" [ -1 3 -4 4 ]
WorldBegin
)");
  const Ray corner = parallel.scene->camera().ray({0, 0}, {});
  EXPECT_NEAR(corner.o.x, -1, 1e-5f);
  EXPECT_NEAR(corner.o.y, 4, 1e-5f);
}

TEST_F(PbrtFeatures, NamesMayComeLater) {
  const LoadedScene scene = world(R"(
NamedMaterial "later"
Shape "disk"
MakeNamedMaterial "later" "string type" "diffuse" "texture reflectance" "paint"
Texture "paint" "spectrum" "constant" "rgb value" [ .2 .4 .6 ]
)");
  EXPECT_NEAR(brdf(scene, 0, 0, {0, 0, 1}).b, 0.6f / kPi, 1e-5f);
}

TEST_F(PbrtFeatures, WhatNothingUsesStopsNothing) {
  const LoadedScene scene = world(R"(
MakeNamedMaterial "odd" "string type" "velvet" "float a" 1 "float b" 2
Texture "odd" "spectrum" "ptex" "string filename" "no.ptx"
Shape "disk"
)");
  EXPECT_TRUE(contains(warnings(scene), "MakeNamedMaterial \"odd\" cannot be read; nothing uses it"));
  EXPECT_TRUE(contains(warnings(scene), "Texture \"spectrum\" \"ptex\" cannot be read; nothing uses it"));
}

/// lights.cpp: DiffuseAreaLight: L = power / (pi area sides), for each triangle of a mesh.
TEST_F(PbrtFeatures, AreaLightsHaveSidesAndPower) {
  const LoadedScene scene = world(R"(
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 1 2 3 ] "bool twosided" true "float scale" 2
Shape "disk" "float radius" 2
AttributeEnd
AreaLightSource "diffuse" "float power" 100
Translate 0 0 5
Shape "trianglemesh" "point3 P" [ -1 -1 0  1 -1 0  1 1 0  -1 1 0 ] "integer indices" [ 0 1 2  0 2 3 ]
)");
  const auto& lights = scene.scene->emitters();
  ASSERT_EQ(lights.size(), 2u);
  EXPECT_NEAR(lights[0]->power().g, 2 * kPi * (4 * kPi) * 4, 1e-3f);
  for (const float z : {1.0f, -1.0f})
    EXPECT_NEAR(lights[0]->sample_towards({0.1f, 0, z}, {0.3f, 0.6f}, 0.5f).radiance.b, 6, 1e-5f);
  EXPECT_NEAR(lights[1]->power().g, 200, 1e-3f);
}

/// lights.cpp: DiffuseAreaLight: alpha thins the light out; a light of alpha 0 shines, but rays do not meet it. Nor do
/// they meet other shapes of alpha 0.
TEST_F(PbrtFeatures, LightsOfAlphaZeroShineUnseen) {
  const LoadedScene scene = world(R"(
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 1 2 3 ] "bool twosided" true
ReverseOrientation
Shape "sphere" "float radius" 2 "float alpha" 0
Translate 10 0 0
Shape "disk" "float alpha" 0.25
AttributeEnd
Shape "sphere" "float alpha" 0
Translate 0 0 -5
Shape "disk"
)");
  EXPECT_EQ(scene.scene->n_shapes(), 3u);
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{0, 0, 9}, {0, 0, -1}}, hit));
  EXPECT_NEAR(hit.p.z, -5, 1e-5f);
  const auto& lights = scene.scene->emitters();
  ASSERT_EQ(lights.size(), 2u);
  const EmitterSample unseen = lights[0]->sample_towards({0, 0, 5}, {0.3f, 0.6f}, 0.5f);
  EXPECT_NEAR(unseen.radiance.b, 3, 1e-5f);
  EXPECT_TRUE(unseen.is_delta);
  EXPECT_NEAR(lights[0]->power().g, kPi * (4 * kPi * 4) * 2, 1e-2f);  // outwards alone
  const EmitterSample thin = lights[1]->sample_towards({10, 0, 5}, {0.3f, 0.6f}, 0.5f);
  EXPECT_NEAR(thin.radiance.b, 0.75f, 1e-5f);
  EXPECT_FALSE(thin.is_delta);
}

/// lights.cpp: ProjectionLight::I and GoniometricLight::I: the image, in the direction of the point.
TEST_F(PbrtFeatures, ImagesShineInTheirDirections) {
  const auto pfm = [](int width, int height, const std::vector<float>& grey) {
    std::string text = "PF\n" + std::to_string(width) + " " + std::to_string(height) + "\n-1\n";
    for (int y = height - 1; y >= 0; --y)  // the last row first
      for (int x = 0; x < width; ++x)
        for (int c = 0; c < 3; ++c)
          text.append(reinterpret_cast<const char*>(&grey[static_cast<size_t>(y * width + x)]), 4);
    return text;
  };
  write("p.pfm", pfm(2, 2, {1, 2, 3, 4}));
  const LoadedScene projection = world("LightSource \"projection\" \"string filename\" \"p.pfm\" \"float scale\" 5\n");
  const auto towards = [&](const LoadedScene& scene, const Vec3& d) {
    return scene.scene->emitters()[0]->sample_towards(normalize(d), {}, 0).radiance.g;
  };
  // x to the right of the image, y up.
  EXPECT_NEAR(towards(projection, {-0.5f, 0.5f, 1}), 5, 1e-4f);
  EXPECT_NEAR(towards(projection, {0.5f, 0.5f, 1}), 10, 1e-4f);
  EXPECT_NEAR(towards(projection, {-0.5f, -0.5f, 1}), 15, 1e-4f);
  EXPECT_NEAR(towards(projection, {0.3f, -0.9f, 1}), 20, 1e-4f);
  EXPECT_EQ(towards(projection, {1.1f, 0, 1}), 0);
  EXPECT_EQ(towards(projection, {0, 0, -1}), 0);

  // Of four by four texels, the inner four lie around the image's z, which is the light's y.
  std::vector<float> texels(16, 1);
  texels[5] = 2, texels[6] = 3, texels[9] = 4, texels[10] = 5;
  write("g.pfm", pfm(4, 4, texels));
  const LoadedScene gonio = world("LightSource \"goniometric\" \"string filename\" \"g.pfm\" \"rgb I\" [ 1 2 3 ]\n");
  EXPECT_NEAR(towards(gonio, {-0.2f, 1, -0.2f}), 2 * 2, 1e-4f);  // x < 0, image y = light z < 0
  EXPECT_NEAR(towards(gonio, {0.2f, 1, -0.2f}), 3 * 2, 1e-4f);
  EXPECT_NEAR(towards(gonio, {0.2f, 1, 0.2f}), 5 * 2, 1e-4f);
  EXPECT_NEAR(towards(gonio, {0, -1, 0.1f}), 2, 1e-4f);
}

TEST_F(PbrtFeatures, AttributesAreDefaults) {
  const LoadedScene scene = world(R"(
AttributeBegin
Attribute "shape" "float radius" 0.5
Attribute "material" "rgb reflectance" [ .1 .2 .3 ]
Material "diffuse"
Shape "sphere"
Translate 3 0 0
Shape "sphere" "float radius" 0.25
AttributeEnd
Translate 6 0 0
Shape "sphere"
)");
  EXPECT_NEAR(height(scene, 0, 0), 0.5f, 1e-5f);
  EXPECT_NEAR(height(scene, 3, 0), 0.25f, 1e-5f);
  EXPECT_NEAR(height(scene, 6, 0), 1, 1e-5f);
  EXPECT_NEAR(brdf(scene, 0, 0, {0, 0, 1}).g, 0.2f / kPi, 1e-5f);
}

TEST_F(PbrtFeatures, OptionsAndColourSpacesAreRead) {
  const LoadedScene scene = load(R"(Option "disablepixeljitter" true
Option "seed" 42
Option "string msereferenceout" [ "a.exr" ]
WorldBegin
ColorSpace "rec2020"
Material "diffuse" "rgb reflectance" [ .2 .5 .3 ]
Shape "sphere"
)");
  EXPECT_TRUE(contains(warnings(scene), "option 'disablepixeljitter' has no effect here"));
  // ITU-R BT.2087: Rec. 2020 to Rec. 709.
  EXPECT_NEAR(brdf(scene, 0, 0, {0, 0, 1}).r * kPi, 1.6605f * 0.2f - 0.5876f * 0.5f - 0.0728f * 0.3f, 1e-3f);
}

TEST_F(PbrtFeatures, WhatMovesIsShownAtTheStart) {
  const LoadedScene scene = world(R"(
TransformTimes 0 1
ActiveTransform EndTime
Translate 0 0 50
ActiveTransform StartTime
Translate 0 0 3
ActiveTransform All
Shape "sphere"
)");
  EXPECT_NEAR(height(scene, 0, 0), 4, 1e-5f);
  EXPECT_TRUE(contains(warnings(scene), "the scene moves: it is shown as it is at the start"));
}

TEST_F(PbrtFeatures, WhatIsFlattenedIsLeftOut) {
  const LoadedScene scene = world(R"(
Shape "sphere"
AttributeBegin
ConcatTransform [ 0 0 0 0  0 1 0 0  0 0 1 0  0 0 9 1 ]
Shape "sphere" LightSource "point"
Identity
Translate 0 0 3
Shape "sphere"
AttributeEnd
)");
  EXPECT_EQ(scene.scene->n_shapes(), 2u);
  EXPECT_EQ(scene.scene->emitters().size(), 0u);
  EXPECT_NEAR(height(scene, 0, 0), 4, 1e-5f);
  EXPECT_TRUE(contains(warnings(scene), "matrix is singular; what it places is left out"));
}

TEST_F(PbrtFeatures, CompressedFilesAreRead) {
  const auto compress = [&](const std::string& name, const std::string& text) {
    gzFile file = gzopen(folder_.file(name).c_str(), "wb");
    ASSERT_TRUE(file);
    gzwrite(file, text.data(), static_cast<unsigned>(text.size()));
    gzclose(file);
  };
  // The parameters of the last directive go on behind the include.
  compress("part.pbrt.gz", "Translate 0 0 2\nShape \"sphere\"");
  compress(
      "mesh.ply.gz",
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face "
      "1\nproperty list uchar int vertex_indices\nend_header\n-9 -9 -3\n9 -9 -3\n0 9 -3\n3 0 1 2\n");
  const LoadedScene scene = world(
      "Include \"part.pbrt.gz\" \"float radius\" 0.5\nIdentity\nShape \"plymesh\" \"string "
      "filename\" \"mesh.ply.gz\"\n");
  EXPECT_NEAR(height(scene, 0, 0), 2.5f, 1e-5f);
  EXPECT_NEAR(height(scene, 1, 0), -3, 1e-5f);
  write("bad.pbrt.gz", "\x1f\x8b no");
  EXPECT_TRUE(contains(errors("WorldBegin\nInclude \"bad.pbrt.gz\"\n"), "its compressed content is "));
}

/// materials.h: DiffuseTransmissionMaterial; textures for roughness: alpha = sqrt(roughness).
TEST_F(PbrtFeatures, MaterialsScatterAsInPbrt) {
  const LoadedScene sheet = world(
      "Material \"diffusetransmission\" \"rgb reflectance\" [ .2 .3 .4 ] \"rgb transmittance\" [ .1 .2 .3 ] \"float "
      "scale\" 0.5\nShape \"disk\"\n");
  EXPECT_NEAR(brdf(sheet, 0, 0, {0.3f, 0, 1}).g, 0.15f / kPi, 1e-5f);
  EXPECT_NEAR(brdf(sheet, 0, 0, {0.3f, 0, -1}).g, 0.1f / kPi, 1e-5f);
  const std::string paint = "Texture \"r\" \"float\" \"constant\" \"float value\" 0.16\n";
  const LoadedScene textured = world(paint + "Material \"conductor\" \"texture roughness\" \"r\"\nShape \"disk\"\n"),
                    plain = world("Material \"conductor\" \"float roughness\" 0.16\nShape \"disk\"\n");
  EXPECT_NEAR(brdf(textured, 0, 0, {0.3f, 0, 1}).g, brdf(plain, 0, 0, {0.3f, 0, 1}).g, 1e-4f);
  // A coat of index 1 is none.
  const LoadedScene bare = world("Material \"coateddiffuse\" \"float eta\" 1\nShape \"disk\"\n");
  EXPECT_NEAR(brdf(bare, 0, 0, {0.3f, 0, 1}).g, 0.5f / kPi, 1e-5f);
  const LoadedScene all = world(R"(
MakeNamedMaterial "a" "string type" "coateddiffuse" "float uroughness" 0.1 "float vroughness" 0.2
MakeNamedMaterial "b" "string type" "coatedconductor" "float interface.roughness" 0.05
  "spectrum conductor.k" "metal-Au-k"
MakeNamedMaterial "c" "string type" "subsurface" "string name" "Skin1" "float roughness" 0.3
MakeNamedMaterial "d" "string type" "mix" "string materials" [ "a" "b" ]
NamedMaterial "d" Shape "disk" NamedMaterial "c" Shape "disk" "float height" 1
)");
  EXPECT_EQ(all.scene->n_shapes(), 2u);
  for (const char* told : {"glTF's clear coat", "scatters no light below its surface"})
    EXPECT_TRUE(contains(warnings(all), told));
}

/// A medium of albedo 0.5 without an interface between indices reflects diffusely [Jensen2001], Eq. (15), with A = 1:
/// 0.25 (1 + exp(-4/3 sqrt(1.5))) exp(-sqrt(1.5)).
TEST_F(PbrtFeatures, SubsurfaceReflectsTheDipolesLight) {
  const LoadedScene scene = world(
      "Material \"subsurface\" \"rgb sigma_a\" [ 1 1 1 ] \"rgb sigma_s\" [ 1 1 1 ] \"float eta\" 1.000001\nShape "
      "\"disk\"\n");
  const double root = std::sqrt(1.5), internal = -1.440 + 0.710 + 0.668 + 0.0636;  // near 0
  const double expected = 0.25 * (1 + std::exp(-4.0 / 3 * (1 + internal) / (1 - internal) * root)) * std::exp(-root);
  EXPECT_NEAR(brdf(scene, 0, 0, {0.3f, 0, 1}).g * kPi, expected, 2e-3);
}

/// textures.cpp through scene files.
TEST_F(PbrtFeatures, TexturesCombine) {
  const auto value = [&](const std::string& textures) {
    const LoadedScene scene = world(textures + R"(
Material "diffuse" "texture reflectance" "t"
Shape "bilinearmesh" "point3 P" [ -1 -1 0  1 -1 0  -1 1 0  1 1 0 ]
)");
    return brdf(scene, 0.25f, 0.5f, {0, 0, 1}) * kPi;  // u = 0.625, v = 0.75
  };
  const std::string parts = R"(
Texture "a" "spectrum" "bilerp" "rgb v00" [ 0 0 0 ] "rgb v10" [ .8 0 0 ] "rgb v01" [ 0 .4 0 ] "rgb v11" [ .8 .4 0 ]
Texture "b" "float" "bilerp" "float v00" 0 "float v10" 1 "float v01" 0 "float v11" 1
)";
  EXPECT_NEAR(value(parts + "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"a\" \"texture scale\" \"b\"\n").r,
              0.8f * 0.625f * 0.625f, 1e-5f);
  EXPECT_NEAR(
      value(parts + "Texture \"t\" \"spectrum\" \"mix\" \"texture tex1\" \"a\" \"rgb tex2\" [ 0 1 0 ] \"texture "
                    "amount\" \"b\"\n")
          .g,
      0.375f * 0.4f * 0.75f + 0.625f, 1e-5f);
  // By position: s = 0.3 + 0.5 x.
  EXPECT_NEAR(
      value("Texture \"t\" \"spectrum\" \"bilerp\" \"string mapping\" \"planar\" \"vector3 v1\" [ .5 0 0 ] \"float "
            "udelta\" 0.3 \"rgb v00\" [ 0 0 0 ] \"rgb v01\" [ 0 0 0 ] \"rgb v10\" [ 1 1 1 ] \"rgb v11\" [ 1 1 1 ]\n")
          .g,
      0.3f + 0.125f, 1e-5f);
  EXPECT_NEAR(
      value("Texture \"t\" \"spectrum\" \"directionmix\" \"rgb tex1\" [ .7 .7 .7 ] \"rgb tex2\" [ 0 0 0 ] \"vector3 "
            "dir\" [ 0 1 1 ]\n")
          .g,
      0.7f * std::sqrt(0.5f), 1e-5f);
  const float marble = value("Texture \"t\" \"spectrum\" \"marble\"\n").b;
  EXPECT_GT(marble, 0.3f);
  EXPECT_LT(marble, 1);
}

/// spectrum.cpp: named illuminants keep their colour and have luminance 1. CIE 15, Table T.3: A at (0.4476, 0.4074).
TEST_F(PbrtFeatures, SpectraHaveNamesAndFiles) {
  write("flat.spd", "# nm value\n300 3\n900 3\n");
  const LoadedScene scene = world(R"(
LightSource "point" "spectrum I" "stdillum-A"
LightSource "point" "spectrum I" "flat.spd"
LightSource "point" "blackbody I" 2856
)");
  const auto rgb = [&](size_t i) { return scene.scene->emitters()[i]->power() / (4 * kPi); };
  const double x = .44757 / .40745, z = (1 - .44757 - .40745) / .40745;
  EXPECT_NEAR(rgb(0).r, 3.240479 * x - 1.537150 - 0.498535 * z, 1e-3);
  EXPECT_NEAR(luminance(rgb(0)), 1, 1e-4);
  EXPECT_NEAR(luminance(rgb(1)), 1, 1e-4);  // illuminant E
  EXPECT_NEAR(rgb(1).r, 1.205f, 5e-3f);
  // Illuminant A is a black body of 2856 K.
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(rgb(2)[c], rgb(0)[c], 0.02f);
}

TEST_F(PbrtFeatures, SeveralSkiesAreOne) {
  const LoadedScene scene =
      world("LightSource \"infinite\" \"rgb L\" [ .1 .2 .3 ]\nLightSource \"infinite\" \"rgb L\" [ .3 .2 .1 ]\n");
  ASSERT_EQ(scene.scene->emitters().size(), 1u);
  EXPECT_NEAR(scene.scene->environment()->environment({0, 0, 1}).radiance.b, 0.4f, 1e-6f);
  EXPECT_TRUE(contains(warnings(world("LightSource \"infinite\" \"point3 portal\" [ 0 0 0 1 0 0 1 1 0 0 1 0 ]\n")),
                       "shines through a portal alone in pbrt"));
}

TEST_F(PbrtFeatures, WarningsOfAKindAreOne) {
  const LoadedScene scene = world(R"(
Material "coateddiffuse" Shape "disk"
Material "coateddiffuse" Shape "disk" "float height" 1
Material "coateddiffuse" Shape "disk" "float height" 2
)");
  EXPECT_TRUE(contains(warnings(scene), "whose clear layer absorbs no light (2 more like this)"));
}

}  // namespace
}  // namespace covary::pbrt_features_test
