// SPDX-License-Identifier: Apache-2.0
// Forms that other programs write and pbrt reads, though its file format page does not have them; and forks of pbrt,
// whose names are unknown.
#include <gtest/gtest.h>

#include <cstring>
#include <string>

#include "support/pbrt_scenes.h"

namespace covary::pbrt_foreign_test {
namespace {

using test_support::contains;

class PbrtForeign : public test_support::PbrtScenes {
 protected:
  /// The world of version 3.
  LoadedScene world_3(const std::string& text) {
    return load("Camera \"perspective\"\nFilm \"image\"\nWorldBegin\n" + text);
  }
  LoadedScene lenient(const std::string& text) {
    write("scene.pbrt", text);
    LoadOptions options;
    options.ignore_unknown = true;
    return load_scene(folder_.file("scene.pbrt"), options);
  }
};

/// parser.cpp, parseNumber(): strtof(), which leaves the rest of a token alone.
TEST_F(PbrtForeign, CommasBehindNumbersAreReadPast) {
  const LoadedScene scene = world("Translate 0, 0, 2,\nShape \"sphere\" \"float radius\" [ .5, ]\n");
  EXPECT_NEAR(height(scene, 0, 0), 2.5f, 1e-5f);
  EXPECT_TRUE(contains(warnings(scene), "3:11: a comma behind a number is read past, as in pbrt (3 more like this)"));
  EXPECT_TRUE(contains(errors("WorldBegin\nTranslate 0,1 2 3\n"), "2:11: found '0,1'; expected a number"));
  EXPECT_TRUE(contains(errors("WorldBegin\nTranslate , 1 2 3\n"), "2:11: found ','; expected a number"));
}

/// triangles.cpp, Triangle::CreateMesh(): no shape.
TEST_F(PbrtForeign, MeshesWithoutVerticesAreLeftOut) {
  const LoadedScene scene = world(
      "AreaLightSource \"diffuse\"\nShape \"trianglemesh\" \"point3 P\" [ ]\n"
      "\"integer indices\" [ ]\nShape \"sphere\"\n");
  EXPECT_EQ(scene.scene->n_shapes(), 1u);
  EXPECT_TRUE(contains(warnings(scene), "4:1: Shape \"trianglemesh\" has no vertices; it is left out, as in pbrt"));
  EXPECT_TRUE(
      contains(errors("WorldBegin\nShape \"trianglemesh\"\n"), "2:1: Shape \"trianglemesh\" has no vertices 'P'"));
}

/// Assimp's exporter writes a temperature and a factor in files of version 4.
TEST_F(PbrtForeign, BlackbodiesMayHaveAFactor) {
  const auto radiance = [&](const std::string& value) {
    const LoadedScene scene = world("LightSource \"infinite\" \"blackbody L\" " + value + "\nShape \"sphere\"\n");
    EXPECT_EQ(contains(warnings(scene), "the second is taken as a factor"), contains(value, "["));
    return scene.scene->environment()->environment({0, 0, 1}).radiance;
  };
  const Spectrum one = radiance("6000"), three = radiance("[ 6000 3 ]");
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(three[c], 3 * one[c], 1e-5f * three[c]);
}

/// materials.cpp, DielectricMaterial::Create(): GetOneSpectrum() takes colours, too.
TEST_F(PbrtForeign, IndicesOfRefractionMayBeColours) {
  const auto index = [&](const std::string& eta) {
    const LoadedScene scene = world("Material \"dielectric\" \"float roughness\" .5 " + eta + "\nShape \"disk\"\n");
    return brdf(scene, 0.2f, 0, {0, 0, 1}).g;
  };
  EXPECT_FLOAT_EQ(index("\"rgb eta\" [ 1.8 1.8 1.8 ]"), index("\"float eta\" 1.8"));
  EXPECT_GT(index("\"rgb eta\" [ 1.8 1.8 1.8 ]"), 1.1f * index("\"float eta\" 1.5"));
  const LoadedScene coloured = world("Material \"dielectric\" \"rgb eta\" [ 1.5 1.5 1.6 ]\nShape \"disk\"\n");
  EXPECT_TRUE(contains(warnings(coloured), "refracts all colours alike, with the index 1.5072"));
}

/// api.cpp of version 3, pbrtWorldEnd(): "Missing end to pbrtAttributeBegin()", a warning; an error in version 4.
TEST_F(PbrtForeign, BlocksOfVersion3MayLackTheirEnd) {
  const LoadedScene scene = world_3("AttributeBegin\nTranslate 0 0 1\nShape \"sphere\"\nWorldEnd\n");
  EXPECT_NEAR(height(scene, 0, 0), 2, 1e-5f);
  EXPECT_TRUE(contains(warnings(scene), "4:1: this block is never ended"));
}

/// pbrt adds up all its lights from all around; images of version 3 may have any shape.
TEST_F(PbrtForeign, LightsFromAllAroundAddUp) {
  for (const auto& [name, value] : {std::pair{"a.pfm", 1.0f}, {"b.pfm", 4.0f}}) {
    std::string pixels(12, '\0');
    for (size_t c = 0; c < 3; ++c) std::memcpy(&pixels[4 * c], &value, 4);
    write(name, "PF\n1 1\n-1.0\n" + pixels);
  }
  const LoadedScene scene = world(R"(LightSource "infinite" "string filename" "a.pfm"
LightSource "infinite" "rgb L" [ .5 .25 .125 ]
LightSource "infinite" "string filename" "b.pfm" "float scale" 2
LightSource "point"
Shape "sphere"
)");
  EXPECT_EQ(scene.scene->emitters().size(), 2u);
  const Spectrum sum = scene.scene->environment()->environment({0, 0.6f, 0.8f}).radiance;
  EXPECT_NEAR(sum.r, 9.5f, 1e-5f);
  EXPECT_NEAR(sum.b, 9.125f, 1e-5f);
}

/// Bidirectional path tracing sees no media here; pbrt's does.
TEST_F(PbrtForeign, BdptOfScenesWithMediaBecomesPath) {
  const std::string inside = "MakeNamedMedium \"fog\" \"string type\" \"homogeneous\"\nAttributeBegin\n";
  const std::string sphere = "Material \"interface\"\nShape \"sphere\"\nAttributeEnd\n";
  const std::string head = "Integrator \"bdpt\" \"integer maxdepth\" 7\nWorldBegin\n" + inside;
  const LoadedScene with = load(head + "MediumInterface \"fog\" \"\"\n" + sphere), without = load(head + sphere);
  EXPECT_EQ(with.integrator_type, "path");
  EXPECT_TRUE(contains(warnings(with), "1:1: integrator 'bdpt' sees no media here and is read as 'path'"));
  EXPECT_EQ(without.integrator_type, "bdpt");
  EXPECT_FALSE(contains(warnings(without), "bdpt"));
}

/// uv.h of version 3: fractions of the coordinates, never negative.
TEST_F(PbrtForeign, TexturesOfCoordinatesBeginAgain) {
  const LoadedScene scene = world_3(R"(Texture "t" "color" "uv" "float uscale" -1 "float vscale" 3
Material "matte" "texture Kd" "t"
Shape "trianglemesh" "point P" [ 0 0 0  4 0 0  4 4 0  0 4 0 ] "float st" [ 0 0 1 0 1 1 0 1 ]
"integer indices" [ 0 1 2 2 3 0 ])");
  const Spectrum value = brdf(scene, 1, 2, {0.3f, 0, 1}) * kPi;  // (u, v) = (0.25, 0.5)
  EXPECT_NEAR(value.r, 0.75f, 1e-4f);
  EXPECT_NEAR(value.g, 0.5f, 1e-4f);
}

/// path.cpp of version 3: light samples are blocked by surfaces without a material, and emission is not added behind
/// them; version 4 adds it.
TEST_F(PbrtForeign, LightsWithoutMaterialAreOpaqueInVersion3) {
  const std::string light = "AreaLightSource \"diffuse\" \"bool twosided\" \"true\"\n";
  const auto shows_back = [&](const LoadedScene& scene) {
    SurfaceHit hit;
    EXPECT_TRUE(scene.scene->intersect({{0, 0, 5}, {0, 0, -1}}, hit));
    return (hit.shape->bsdf()->flags() & kNullTransmission) != 0;
  };
  EXPECT_FALSE(shows_back(world_3(light + "Material \"none\"\nShape \"sphere\"\n")));
  EXPECT_TRUE(shows_back(world_3("Material \"none\"\nShape \"sphere\"\n")));
  EXPECT_TRUE(shows_back(world(light + "Material \"interface\"\nShape \"sphere\"\n")));
}

TEST_F(PbrtForeign, GuidedPathsArePaths) {
  for (const char* type : {"guidedpath", "guidedvolpath"}) {
    const LoadedScene scene =
        load("Integrator \"" + std::string(type) + "\" \"bool usenee\" true \"string dtype\" \"vmm\"\n" +
             "Film \"guidedgbuffer\" \"integer xresolution\" 30\nWorldBegin\nShape \"sphere\"\n");
    EXPECT_EQ(scene.integrator_type, "path");
    EXPECT_EQ(scene.width, 30);
    EXPECT_TRUE(contains(warnings(scene), "is read as 'path': the expected picture is the same"));
  }
}

TEST_F(PbrtForeign, UnknownNamesAreIgnoredOnDemand) {
  const std::string text = R"(Film "swirl" "integer xresolution" 30 "integer yresolution" 20 "bool saveradiance" true
Integrator "mine" "float guess" 3
Camera "perspective" "float zoom" 2
WorldBegin
LightSource "laser" "float width" 1
LightSource "point" "float spread" 20
Material "velvet" "rgb sheen" [ 1 1 1 ]
Shape "knot" "float turns" 3
Shape "sphere" "float fuzz" 3
)";
  const LoadedScene scene = lenient(text);
  EXPECT_EQ(scene.width, 30);
  EXPECT_EQ(scene.integrator_type, "path");
  EXPECT_EQ(scene.scene->n_shapes(), 1u);
  EXPECT_EQ(scene.scene->emitters().size(), 1u);
  EXPECT_NEAR(brdf(scene, 0, 0, {0, 0, 1}).g, 0.5f / kPi, 1e-5f);
  for (const char* message : {"1:1: Film \"swirl\" is unknown; it is read as 'rgb'",
                              "2:1: Integrator \"mine\" is unknown; it becomes 'path', with media",
                              "3:1: Camera \"perspective\" has the parameter 'zoom', which is ignored",
                              "5:1: LightSource \"laser\" is unknown; it is left out",
                              "6:1: LightSource \"point\" has the parameter 'spread', which is ignored",
                              "7:1: Material \"velvet\" is unknown; it becomes 'diffuse', grey",
                              "8:1: Shape \"knot\" is unknown; it is left out",
                              "9:1: Shape \"sphere\" has the parameter 'fuzz', which is ignored"})
    EXPECT_TRUE(contains(warnings(scene), message)) << message << "\n" << warnings(scene);
  const std::string refused = errors(text);
  for (const char* message : {"1:1: Film \"swirl\" is not supported", "2:1: Integrator \"mine\" is not supported",
                              "3:22: parameter 'zoom' of Camera", "5:1: LightSource \"laser\" is not supported",
                              "6:21: parameter 'spread' of LightSource", "7:1: Material \"velvet\" is not supported",
                              "8:1: Shape \"knot\" is not supported", "9:16: parameter 'fuzz' of Shape"})
    EXPECT_TRUE(contains(refused, message)) << message << "\n" << refused;
}

}  // namespace
}  // namespace covary::pbrt_foreign_test
