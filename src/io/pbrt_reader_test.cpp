// SPDX-License-Identifier: Apache-2.0
// pbrt scenes against the same scenes written by hand in Mitsuba XML: camera rays, hits, reflection and light. No
// statistics; numbers agree up to rounding in the transformations.
#include "pbrt/pbrt_reader.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/random.h"
#include "core/srgb.h"
#include "formats/xml_values.h"
#include "io/load_scene.h"
#include "support/files.h"
#include "support/same_scene.h"

namespace covary {
namespace {

using test_support::contains;
using test_support::message_of;

class Pbrt : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    std::ofstream(folder_.file(name), std::ios::binary) << text;
  }
  LoadedScene load(const std::string& name, const std::string& text) {
    write(name, text);
    return load_scene(folder_.file(name));
  }
  LoadedScene pbrt(const std::string& text) { return load("scene.pbrt", text); }
  LoadedScene xml(const std::string& body) {
    return load("scene.xml", "<scene version=\"3.0.0\">\n" + body + "\n</scene>\n");
  }
  std::string errors(const std::string& text) {
    std::string found = message_of([&] { pbrt(text); });
    for (size_t i; (i = found.find(folder_.file(""))) != std::string::npos;) found.erase(i, folder_.file("").size());
    return found;
  }
  test_support::TemporaryFolder folder_;
};

const char* const kTriangle = R"(ply
format ascii 1.0
element vertex 3
property float x
property float y
property float z
property float nx
property float ny
property float nz
property float u
property float v
element face 1
property list uchar int vertex_indices
end_header
-.5 -.75 0 0 0 1 0 0
1.5 -.75 0 .2 0 1 1 0
.5 1.25 .5 0 .1 1 0 1
3 0 1 2
)";
const char* const kFloor = R"(ply
format ascii 1.0
element vertex 4
property float x
property float y
property float z
property float u
property float v
element face 2
property list uchar int vertex_indices
end_header
-20 -20 -1 0 0
20 -20 -1 1 0
-20 20 -1 0 1
20 20 -1 1 1
3 1 2 0
3 1 3 2
)";

const std::string kPbrtHead = R"(LookAt 3 4 1.5  .5 .5 0  0 0 1
Camera "perspective" "float fov" 45
Film "rgb" "integer xresolution" 60 "integer yresolution" [ 40 ] "string filename" "a.exr"
Sampler "zsobol" "integer pixelsamples" 32
PixelFilter "box"
Integrator "volpath" "integer maxdepth" [ 4 ]
WorldBegin
)";
const std::string kXmlHead = R"(<integrator type="path"><integer name="max_depth" value="5"/></integrator>
<sensor type="perspective"><float name="fov" value="45"/><string name="fov_axis" value="smaller"/>
<float name="far_clip" value="1e7"/>
<transform name="to_world"><scale x="-1"/><lookat origin="3, 4, 1.5" target=".5, .5, 0" up="0, 0, 1"/></transform>
<sampler type="sobol"><integer name="sample_count" value="32"/></sampler>
<film type="hdrfilm"><integer name="width" value="60"/><integer name="height" value="40"/><rfilter type="box"/></film>
</sensor>
)";

const std::string kGlassAndFloor = R"(
LightSource "infinite" "rgb L" [ .4 .45 .5 ]
LightSource "distant" "point3 from" [ -30 40 100 ] "rgb L" [ 1.5 1.4 1.3 ] "float scale" 2
AttributeBegin
  Material "dielectric"
  Shape "sphere" "float radius" 1   # a glass ball
AttributeEnd
AttributeBegin
  Texture "checks" "spectrum" "checkerboard" "float uscale" [ 16 ] "float vscale" 16
          "rgb tex1" [ .1 .1 .1 ] "rgb tex2" [ .8 .8 .8 ]
  Material "diffuse" "texture reflectance" "checks"
  Translate 0 0 -1
  Shape "bilinearmesh" "point3 P" [ -20 -20 0   20 -20 0   -20 20 0   20 20 0 ]
        "point2 uv" [ 0 0  1 0  0 1  1 1 ]
AttributeEnd
AttributeBegin
  AreaLightSource "diffuse" "blackbody L" [ 3000 ] "float scale" 5
  Translate 0 2 2 Rotate 90 1 0 0
  Shape "disk" "float radius" .5
AttributeEnd
)";
const std::string kObjects =
    R"(MakeNamedMaterial "copper" "string type" "conductor" "spectrum eta" "metal-Cu-eta" "spectrum k" "metal-Cu-k"
  "float roughness" .25
MakeNamedMaterial "paint" "string type" "diffuse" "rgb reflectance" [ .6 .3 .1 ]
MakeNamedMaterial "both" "string type" "mix" "string materials" [ "paint" "copper" ] "float amount" .3
AttributeBegin
  CoordinateSystem "here"
  TransformBegin
    Translate 9 9 9
  TransformEnd
  ConcatTransform [ 1 0 0 0  0 1 0 0  0 0 1 0  .5 .25 0 1 ]
  NamedMaterial "both"
  Shape "trianglemesh" "integer indices" [ 0 1 2 ] "point3 P" [ -1 -1 0  1 -1 0  0 1 .5 ]
    "normal3 N" [ 0 0 1  .2 0 1  0 .1 1 ] "point2 uv" [ 0 0  1 0  0 1 ]
AttributeEnd
ReverseOrientation
ObjectBegin "ball"
  NamedMaterial "copper"
  Shape "sphere" "float radius" .5
ObjectEnd
Translate -1.5 0 0
ObjectInstance "ball"
CoordSysTransform "here"
Translate 1.5 1 0
ObjectInstance "ball"
LightSource "point" "point3 from" [ 0 0 4 ] "rgb I" [ 1 2 3 ]
)";

// The example in pbrt's documentation of the file format, shortened.
TEST_F(Pbrt, IsTheSceneByHand) {
  const LoadedScene a = pbrt(kPbrtHead + kGlassAndFloor);
  write("floor.ply", kFloor);
  const Spectrum glow = spectrum_to_rgb(blackbody_spectrum(3000, 1), SpectrumRole::kEmission);
  const Spectrum l = glow * (5 / luminance(glow));
  const LoadedScene b =
      xml(kXmlHead + R"(
<emitter type="constant"><rgb name="radiance" value=".4, .45, .5"/></emitter>
<emitter type="directional"><vector name="direction" value="30, -40, -99"/>
<rgb name="irradiance" value="3, 2.8, 2.6"/></emitter>
<shape type="sphere"><bsdf type="dielectric"><float name="int_ior" value="1.5"/><float name="ext_ior" value="1"/></bsdf>
</shape>
<shape type="ply"><string name="filename" value="floor.ply"/><boolean name="face_normals" value="true"/>
<bsdf type="twosided"><bsdf type="diffuse"><texture name="reflectance" type="checkerboard">
<transform name="to_uv"><scale x="8" y="8"/></transform>
<rgb name="color0" value=".1"/><rgb name="color1" value=".8"/></texture></bsdf></bsdf></shape>
<shape type="disk"><transform name="to_world"><scale x=".5" y=".5"/><rotate x="1" angle="90"/>
<translate y="2" z="2"/></transform><bsdf type="twosided"><bsdf type="diffuse"/></bsdf>
<emitter type="area"><rgb name="radiance" value=")" +
          std::to_string(l.r) + ", " + std::to_string(l.g) + ", " + std::to_string(l.b) + R"("/></emitter></shape>)");
  test_support::expect_same_scene(a, b, 300);
}

TEST_F(Pbrt, BlocksTransformationsAndMeshesAreTheSceneByHand) {
  const LoadedScene a = pbrt(R"(Scale -1 1 1
LookAt 0 0 5  0 0 0  0 1 0
Camera "perspective" "float fov" [ 40 ] "float lensradius" .1 "float focaldistance" 4.5
Film "rgb" "integer xresolution" 40 "integer yresolution" 50
PixelFilter "triangle" "float xradius" 1 "float yradius" 1
WorldBegin
)" + kObjects);
  write("t.ply", kTriangle);
  const LoadedScene b = xml(R"(<integrator type="path"><integer name="max_depth" value="6"/></integrator>
<sensor type="thinlens"><float name="fov" value="40"/><string name="fov_axis" value="smaller"/>
<float name="aperture_radius" value=".1"/><float name="focus_distance" value="4.5"/><float name="far_clip" value="1e7"/>
<transform name="to_world"><lookat origin="0, 0, 5" target="0, 0, 0" up="0, 1, 0"/></transform>
<sampler type="independent"><integer name="sample_count" value="16"/></sampler>
<film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="50"/>
<rfilter type="tent"/></film></sensor>
<bsdf type="twosided" id="copper"><bsdf type="roughconductor"><rgb name="eta" value="0.10517, 0.9779, 1.20456"/>
<rgb name="k" value="3.27379, 2.59248, 2.36897"/>
<string name="distribution" value="ggx"/><float name="alpha" value=".5"/></bsdf></bsdf>
<shape type="ply"><string name="filename" value="t.ply"/><bsdf type="blendbsdf"><float name="weight" value=".3"/>
<bsdf type="twosided"><bsdf type="diffuse"><rgb name="reflectance" value=".6, .3, .1"/></bsdf></bsdf>
<ref id="copper"/></bsdf></shape>
<shape type="shapegroup" id="g"><shape type="sphere"><float name="radius" value=".5"/>
<boolean name="flip_normals" value="true"/><ref id="copper"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="-1.5"/></transform></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><translate x="1.5" y="1"/></transform></shape>
<emitter type="point"><point name="position" x="0" y="0" z="4"/><rgb name="intensity" value="1, 2, 3"/></emitter>)");
  test_support::expect_same_scene(a, b, 80);
}

/// Images of infinite lights: pbrt's axes of the square, rotated by the light's transformation.
TEST_F(Pbrt, ImagesOfInfiniteLightsShineFromTheirDirections) {
  // Texels 1, 2, 3 lie around +z, x < 0 and y < 0 first; those around -z are at the corners.
  std::string texels;
  for (int i = 0; i < 16; ++i) texels += std::string(3, static_cast<char>(i * 16));
  write("sky.ppm", "P6\n4 4\n255\n" + texels);
  const LoadedScene a = pbrt(R"(Camera "perspective"
WorldBegin
Scale -1 1 1
Rotate 90 0 0 1
LightSource "infinite" "string filename" "sky.ppm" "float scale" 2
Shape "sphere"
)");
  ASSERT_TRUE(a.scene->environment());
  const auto expect = [&](const Vec3& local, int texel) {
    const Vec3 d = normalize(Vec3{local.y, local.x, local.z});  // rotated by 90 degrees, then mirrored
    EXPECT_NEAR(a.scene->environment()->environment(d).radiance.g,
                2 * srgb_to_linear(static_cast<float>(texel * 16) / 255), 1e-4f)
        << texel;
  };
  expect({-0.2f, -0.2f, 1}, 5);
  expect({0.2f, -0.2f, 1}, 6);
  expect({-0.2f, 0.2f, 1}, 9);
  expect({0.2f, 0.2f, 1}, 10);
  expect({0.2f, 0.2f, -1}, 15);
  expect({-0.2f, 0.2f, -1}, 12);
  expect({1, 0.1f, 0.1f}, 11);
}

/// Round tubes along the curves: the height above the axis is the radius given by pbrt's widths.
TEST_F(Pbrt, CurvesAreTubes) {
  const LoadedScene a = pbrt(R"(Camera "perspective"
WorldBegin
Material "hair" "rgb sigma_a" [ .1 .2 .3 ]
Scale 2 2 2
# Straight, evenly parametrised: x = -1 … 1, its radius 0.1 … 0.05; then to a tip; then of degree 2.
Shape "curve" "point3 P" [ -1 0 0  -.33333333 0 0  .33333333 0 0  1 0 0 ] "float width0" .2 "float width1" .1
Shape "curve" "point3 P" [ -1 2 0  -.33333333 2 0  .33333333 2 0  1 2 0 ] "float width0" .2 "float width1" 0
Translate 0 4 0
Shape "curve" "integer degree" 2 "point3 P" [ -1 0 0  0 0 0  1 0 0 ] "float width" .2
# A B-spline of two segments, x = 0 … 2.
Shape "curve" "string basis" "bspline" "point3 P" [ -1 2 0  0 2 0  1 2 0  2 2 0  3 2 0 ] "float width" .2
Material "hair" "rgb reflectance" [ .1 .2 .3 ]
Shape "curve" "string type" "cylinder" "point3 P" [ -1 4 0  0 5 0  0 5 0  1 4 0 ] "float width" .2
)");
  EXPECT_EQ(a.scene->n_shapes(), 2u);  // curves of one material are merged
  const auto height = [&](float x, float y) {
    SurfaceHit hit;
    return a.scene->intersect({{x, y, 10}, {0, 0, -1}}, hit) ? hit.p.z : 0;
  };
  for (const float x : {-0.9f, -0.3f, 0.2f, 0.8f}) {
    EXPECT_NEAR(height(2 * x, 0), 2 * (0.1f - 0.05f * (x + 1) / 2), 1e-3f) << x;
    EXPECT_NEAR(height(2 * x, 4), 2 * (0.1f - 0.1f * (x + 1) / 2), 1e-3f) << x;
    EXPECT_NEAR(height(2 * x, 8), 0.2f, 1e-3f) << x;
    EXPECT_NEAR(height(2 * (x + 1), 12), 0.2f, 1e-3f) << x;
  }
  EXPECT_LT(height(1.998f, 4), 0.01f);  // near the tip
  EXPECT_EQ(height(2 * 2.1f, 12), 0);
  EXPECT_NEAR(height(0, 2 * (4 + 4 + 0.75f)), 0.2f, 1e-3f);  // the top of the arc
}

TEST_F(Pbrt, MediaAreTheSceneByHand) {
  const LoadedScene a = pbrt(R"(MakeNamedMedium "fog" "string type" "homogeneous" "rgb sigma_a" [ .1 .2 0 ]
  "rgb sigma_s" [ .3 .2 0 ] "float scale" 2 "float g" .5
MediumInterface "" "fog"
Camera "perspective"
WorldBegin
MakeNamedMedium "milk" "string type" "homogeneous"
AttributeBegin
  MediumInterface "milk" "fog"
  Material "interface"
  Translate 0 0 3
  Shape "sphere"
AttributeEnd
MediumInterface "fog"
Translate 0 0 6
Shape "sphere"
)");
  const Medium* camera = a.scene->camera_medium();
  ASSERT_TRUE(camera);
  // The media in front of and behind the first hit of a ray along +z.
  const auto media = [&](float z) {
    SurfaceHit hit;
    EXPECT_TRUE(a.scene->intersect({{0, 0, z}, {0, 0, 1}}, hit));
    return std::pair(hit.shape->medium_towards(hit.ng, {0, 0, -1}), hit.shape->medium_towards(hit.ng, {0, 0, 1}));
  };
  const auto [fog, milk] = media(0);
  ASSERT_TRUE(milk);
  EXPECT_EQ(fog, camera);
  const Medium::Coefficients in_fog = fog->at({0, 0, 0}), in_milk = milk->at({0, 0, 0});
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(in_fog.extinction[c], c < 2 ? 0.8f : 0, 1e-6f);
    EXPECT_NEAR(in_fog.scattering[c], c == 0 ? 0.6f : c == 1 ? 0.4f : 0, 1e-6f);
    EXPECT_EQ(in_milk.extinction[c], 2);
    EXPECT_EQ(in_milk.scattering[c], 1);
  }
  EXPECT_EQ(media(4.5f), std::pair(camera, camera));
}

TEST_F(Pbrt, IncludesAreReadInPlace) {
  write("ball.pbrt", "Translate 0 0 1\nShape \"sphere\"\n");
  // Height of the topmost sphere in each column: the ball, which moves all later ones; then that of Import.
  const LoadedScene a = pbrt(kPbrtHead + R"(
Include "ball.pbrt"
Translate 3 0 0 Shape "sphere"
Import "ball.pbrt"
Translate 3 0 0 Shape "sphere")");
  ASSERT_EQ(a.scene->n_shapes(), 4u);
  const float heights[] = {2, 3, 2};
  for (int i = 0; i < 3; ++i) {
    SurfaceHit hit;
    ASSERT_TRUE(a.scene->intersect({{3.0f * static_cast<float>(i), 0, 100}, {0, 0, -1}}, hit));
    EXPECT_NEAR(hit.p.z, heights[i], 1e-3f);
  }
  write("ball.pbrt", "Include \"ball.pbrt\"\n");
  EXPECT_TRUE(contains(errors(kPbrtHead + "Include \"ball.pbrt\"\n"), "more than 15 files inside each other"));
}

TEST_F(Pbrt, OrthographicCamerasSeeTheShorterSide) {
  const LoadedScene a =
      pbrt("Camera \"orthographic\"\nFilm \"rgb\" \"integer xresolution\" 40 \"integer yresolution\" 20\nWorldBegin\n");
  const Camera& camera = a.scene->camera();
  EXPECT_LT(test_support::difference(camera.ray({40, 0}, {}).at(0), Vec3{2, 1, camera.ray({40, 0}, {}).at(0).z}), 1e-5);
  EXPECT_LT(test_support::difference(camera.ray({0, 20}, {}).d, Vec3{0, 0, 1}), 1e-6);
}

TEST_F(Pbrt, WhatIsNotSupportedIsNamed) {
  const std::string found = errors(R"(Camera "perspective" "float screenwindow" [ 1 1 -1 1 ]
WorldBegin
Material "velvet"
Shape "sphere" "float radios" 2 "float zmin" 0
Shape "disk"
Shape "curve" "string basis" "linear" "point3 P" [ 0 0 0 1 0 0 ]
Material "diffuse" "texture reflectance" "wood"
Shape "disk" Shape "trianglemesh" "point3 P" [ 0 0 0  1 0 0  0 1 0 ] "integer indices" [ 0 1 3 ]
LightSource "infinite" "string filename" "sky.exr" "rgb L" [ 1 1 1 ]
AreaLightSource "sphere"
NamedMaterial "gold"
Shape "sphere" "rgb radius" [ 1 1 1 ]
ObjectInstance "tree"
Texture "t" "spectrum" "ptex"
Material "diffuse" "texture reflectance" "t"
Shape "plymesh" "string filename" "no.ply"
Translate 0 0 0
MakeNamedMedium "smoke" "string type" "vapour"
MediumInterface "smoke" ""
Shape "disk"
MediumInterface "mist" ""
Shape "disk" Shape "disk"
LightSource "projection"
Material "coateddiffuse" "rgb reflectnace" [1 1 1] Shape "sphere"
)");
  for (const char* message : {
           "scene.pbrt:1:1: 'screenwindow' is empty",
           "scene.pbrt:3:1: Material \"velvet\" is not supported; supported: materials 'coatedconductor', ",
           "scene.pbrt:4:16: parameter 'radios' of Shape \"sphere\" is not supported; did you mean 'radius'?",
           "scene.pbrt:6:1: Shape \"curve\" has basis 'linear' and degree 3; supported: 'bezier'",
           "scene.pbrt:7:20: parameter 'reflectance' of Material \"diffuse\" names the texture 'wood', which is not a "
           "texture of spectra",
           "scene.pbrt:8:14: Shape \"trianglemesh\" has the index 3; there are 3 vertices",
           "scene.pbrt:9:24: parameter 'filename' of LightSource \"infinite\" is given with 'L'",
           "scene.pbrt:10:1: AreaLightSource \"sphere\" is not supported; supported: 'diffuse'",
           "scene.pbrt:11:1: no material has the name 'gold'",
           "scene.pbrt:12:16: parameter 'radius' of Shape \"sphere\" has the type 'rgb'; expected 'float'",
           "scene.pbrt:13:1: no object before this one has the name 'tree'",
           "scene.pbrt:14:1: Texture \"spectrum\" \"ptex\" has colours for each face of its mesh (Ptex)",
           "no.ply",
           "scene.pbrt:18:1: MakeNamedMedium \"smoke\" is of the type 'vapour'; supported: 'cloud'",
           "scene.pbrt:21:1: no medium has the name 'mist'",
           "scene.pbrt:23:1: LightSource \"projection\" has no 'filename'",
           "scene.pbrt:24:26: parameter 'reflectnace' of Material \"coateddiffuse\" is not supported; did you mean "
           "'reflectance'?",
       })
    EXPECT_TRUE(contains(found, message)) << message << "\n" << found;
  // One cause, one message, however many shapes it stops.
  EXPECT_EQ(found.find("velvet"), found.rfind("velvet"));
  EXPECT_EQ(found.find("mist"), found.rfind("mist"));
}

TEST_F(Pbrt, TypesWithASimilarNameAreToldFirst) {
  const std::string found = errors(R"(Camera "perspectiv"
WorldBegin
Texture "wood" "spectrum" "imagemop"
Material "diffuse" "texture reflectance" "wood"
Shape "sphere"
Material "dielektric"
Shape "sphere"
Shape "sfere"
)");
  for (const char* message :
       {"Camera \"perspectiv\" is not supported; did you mean 'perspective'? Supported: cameras 'orthographic', ",
        "is not supported; did you mean 'imagemap'? Supported: textures 'bilerp', ",
        "scene.pbrt:6:1: Material \"dielektric\" is not supported; did you mean 'dielectric' or 'thindielectric'? "
        "Supported: ",
        "scene.pbrt:8:1: Shape \"sfere\" is not supported; did you mean 'sphere'? Supported: shapes 'bilinearmesh', "})
    EXPECT_TRUE(contains(found, message)) << message << "\n" << found;
}

/// Chains that would overflow the stack, and mixtures of mixtures that would take forever.
TEST_F(Pbrt, ReferencesToReferencesEnd) {
  const std::string head = "Camera \"perspective\"\nWorldBegin\n";
  std::string deep = head + "Texture \"0\" \"spectrum\" \"constant\" \"rgb value\" [ .5 .5 .5 ]\n", wide = head;
  for (int i = 1; i < 30000; ++i)
    deep += fmt::format("Texture \"{}\" \"spectrum\" \"scale\" \"texture tex\" \"{}\"\n", i, i - 1);
  wide += "MakeNamedMaterial \"0\" \"string type\" \"diffuse\"\n";
  for (int i = 1; i < 60; ++i)
    wide += fmt::format("MakeNamedMaterial \"{0}\" \"string type\" \"mix\" \"string materials\" [ \"{1}\" \"{1}\" ]\n",
                        i, i - 1);
  deep += "Material \"diffuse\" \"texture reflectance\" \"29999\"\nShape \"sphere\"\n";
  wide += "NamedMaterial \"59\"\nShape \"sphere\"\n";
  EXPECT_TRUE(contains(errors(deep), "refers to too many others in a row"));
  EXPECT_TRUE(contains(errors(wide), "bsdf 'blendbsdf' holds "));
  EXPECT_TRUE(contains(errors(wide), " objects when every reference is followed; at most "));
}

TEST_F(Pbrt, MistakesOfTheTextEndTheReading) {
  const auto starts = [&](const std::string& text, const std::string& message) {
    EXPECT_TRUE(errors(text).starts_with(message)) << errors(text);
  };
  starts("WorldBegin\nShap \"sphere\"\n", "scene.pbrt:2:1: 'Shap' is not a supported directive; did you mean 'Shape");
  starts("Shape \"sphere\n", "scene.pbrt:1:7: unterminated string");
  starts("Translate 1 2\n", "scene.pbrt:2:1: found the end of the file; expected a number");
  starts("Scale 1 2 x\n", "scene.pbrt:1:11: found 'x'; expected a number");
  starts("WorldBegin AttributeEnd", "scene.pbrt:1:12: the end of a block that was never begun");
  starts("WorldBegin\nShape \"sphere\" \"colour c\" [ 1 1 1 ]",
         "scene.pbrt:2:16: unknown type 'colour' of parameter 'c'; did you mean 'color'?");
  starts("SurfaceIntegrator \"path\"",
         "scene.pbrt:1:1: 'SurfaceIntegrator' is not a supported directive: this is a scene of pbrt-v2");
  starts("WorldBegin\nAttributeBegin\n", "scene.pbrt:2:1: unterminated block");
  starts("", "scene.pbrt:1:1: the scene has no WorldBegin");
  starts("]", "scene.pbrt:1:1: found ']'; expected a directive");
}

TEST_F(Pbrt, WhatLooksDifferentIsAWarning) {
  const LoadedScene a = pbrt(R"(Integrator "mlt" PixelFilter "box" "float xradius" 2
WorldBegin
LightSource "spot"
Material "coateddiffuse" "float roughness" 0
Shape "disk"
ObjectBegin "lamp" AreaLightSource "diffuse" Shape "sphere" ObjectEnd
ObjectInstance "lamp"
)");
  std::string all;
  for (const std::string& warning : a.warnings) all += warning + "\n";
  for (const char* message : {"Integrator \"mlt\" is read as 'path'", "PixelFilter \"box\" is read as 'gaussian'",
                              "Material \"coateddiffuse\" is read as 'plastic'",
                              "Shape \"sphere\" emits no light, because it is part of an object"})
    EXPECT_TRUE(contains(all, message));
  LoadOptions options;
  options.defines["a"] = "1";
  EXPECT_TRUE(contains(message_of([&] { load_scene(folder_.file("scene.pbrt"), options); }),
                       "scenes of pbrt have no parameters to define"));
}

/// 3,000 texts with a few bytes changed, truncated, or words swapped: each loads or is rejected with a message.
TEST_F(Pbrt, DamagedTextsDoNoHarm) {
  const std::string whole = kPbrtHead + kObjects + kGlassAndFloor;
  int loaded = 0;
  for (int i = 0; i < 3000; ++i) {
    const PathRandom random(Sampling::kIndependent, 2, 0, 0, i);
    std::string text = whole;
    for (uint32_t k = 0; k < 1 + static_cast<uint32_t>(i % 3); ++k) {
      const Vec2 u = random.get_2d(k, Event::kDirection);
      const auto place = static_cast<size_t>(u.x * static_cast<float>(text.size()));
      if (i % 5 == 0)
        text.erase(place, static_cast<size_t>(u.y * 20));
      else if (i % 5 == 1)
        text.insert(place, whole, static_cast<size_t>(u.y * static_cast<float>(whole.size())), 30);
      else
        text[place] = " \"[]-0123456789exABSTC#\n"[static_cast<size_t>(u.y * 24)];
    }
    try {
      load_scene_text(text, folder_.file("scene.pbrt"));
      ++loaded;
    } catch (const Error& error) {
      EXPECT_NE(error.code(), ErrorCode::kInternal) << error.what() << "\n" << text;
    }
  }
  EXPECT_GT(loaded, 50);
}

}  // namespace
}  // namespace covary
