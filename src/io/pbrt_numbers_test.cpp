// SPDX-License-Identifier: Apache-2.0
// Numbers of pbrt scenes: exposure, white balance, power of lights, clamped reflectances, texture coordinates, sides,
// glasses and metals, defaults. Expected values come from the formulas in pbrt-v4's sources; each test names the file.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "core/arena.h"
#include "core/srgb.h"
#include "imageio/png.h"
#include "io/convert_scene.h"
#include "io/load_scene.h"
#include "pbrt/pbrt_objects.h"
#include "support/files.h"
#include "support/pbrt_scenes.h"

namespace covary::pbrt_numbers_test {
namespace {

using test_support::contains;

class PbrtNumbers : public test_support::PbrtScenes {
 protected:
  /// Four grey texels, v upwards: 51, 102 in the lower row, 153, 204 in the upper one.
  void write_quarters() {
    std::vector<uint8_t> rgb;
    for (const int value : {153, 204, 51, 102}) rgb.insert(rgb.end(), 3, static_cast<uint8_t>(value));
    const std::vector<unsigned char> bytes = encode_png(2, 2, rgb);
    write("quarters.png", {bytes.begin(), bytes.end()});
  }
  /// The reflectance that a ray meets, from the value of a diffuse material; -1 without a hit.
  float reflectance(const LoadedScene& scene, const Vec3& from, const Vec3& to) {
    SurfaceHit hit;
    const Vec3 d = normalize(to - from);
    if (!scene.scene->intersect({from, d}, hit)) return -1;
    const Vec3 wo = hit.frame.to_local(-d), wi{0, 0, wo.z > 0 ? 1.0f : -1.0f};
    Arena arena;
    const BsdfClosure* closure = hit.shape->bsdf()->bind(hit, wo.z > 0, TransportMode::kRadiance, arena);
    return closure->eval(wo, wi).value.g * kPi;
  }
};

/// texel: (u, v) quarter of quarters.png.
float texel(int u, int v) { return srgb_to_linear(static_cast<float>(51 * (1 + u + 2 * v)) / 255); }

const std::string kTexture =
    "Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"quarters.png\" \"string filter\" \"point\"\n"
    "Material \"diffuse\" \"texture reflectance\" \"t\"\n";

/// film.cpp, PixelSensor::Create: imagingRatio = exposureTime * ISO / 100; scene.cpp: exposureTime = shutterclose -
/// shutteropen. All lights are proportional to the picture.
TEST_F(PbrtNumbers, ExposureScalesAllLights) {
  write("sky.pfm", "PF\n1 1\n-1.0\n" + std::string("\0\0\x80\x3f\0\0\x80\x3f\0\0\x80\x3f", 12));
  const std::string lights = R"(WorldBegin
LightSource "point" "rgb I" [ 1 2 3 ]
LightSource "distant" "rgb L" [ 1 2 3 ] "float scale" 3
LightSource "spot" "rgb I" [ 1 2 3 ]
AttributeBegin
AreaLightSource "diffuse" "rgb L" [ 1 2 3 ]
Shape "sphere"
AttributeEnd
)";
  const std::string skies[] = {"LightSource \"infinite\" \"rgb L\" [ 1 2 3 ]\n",
                               "LightSource \"infinite\" \"string filename\" \"sky.pfm\"\n"};
  for (const std::string& sky : skies) {
    const LoadedScene plain = load("Film \"rgb\"\nCamera \"perspective\"\n" + lights + sky);
    const LoadedScene exposed = load(
        "Film \"rgb\" \"float iso\" 400\nCamera \"perspective\" \"float shutteropen\" 0.25 \"float shutterclose\" "
        "0.75\n" +
        lights + sky);
    EXPECT_EQ(warnings(exposed), warnings(plain));
    const auto &a = plain.scene->emitters(), &b = exposed.scene->emitters();
    ASSERT_EQ(a.size(), 5u);
    ASSERT_EQ(b.size(), 5u);
    for (size_t i = 0; i < a.size(); ++i)
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(b[i]->power()[c], 2 * a[i]->power()[c], 1e-5f * a[i]->power()[c]) << i;
  }
  EXPECT_TRUE(contains(errors("Camera \"perspective\" \"float shutterclose\" 0\nWorldBegin\n"),
                       "is exposed for 0 seconds: 'shutterclose' must be greater"));
  EXPECT_TRUE(
      contains(errors("Film \"rgb\" \"float iso\" -1\nWorldBegin\n"), "has iso -1; expected a positive number"));
}

TEST_F(PbrtNumbers, WhatTheFilmChangesIsAWarning) {
  const LoadedScene scene =
      load(R"(Film "rgb" "string sensor" "canon_eos_100d" "float iso" 150 "float whitebalance" 4000
  "float maxcomponentvalue" 20 "float exposuretime" 2
WorldBegin
LightSource "point" "rgb I" [ 1 1 1 ]
)");
  for (const char* message : {"has the sensor 'canon_eos_100d'; its picture has the colours of 'cie1931'",
                              "clamps samples to 20 in pbrt", "has an 'exposuretime', which pbrt does not read"})
    EXPECT_TRUE(contains(warnings(scene), message));
  EXPECT_NEAR(scene.scene->emitters()[0]->power().g, 1.5f * 4 * kPi, 1e-4f);
}

/// color.h: WhiteBalance(); spectrum.cpp: Spectra::D(). The light that is balanced becomes white, and what is white
/// under daylight becomes bluish for a low temperature; that of Rec. 709, 6504 K by the CIE's definition, changes
/// nothing.
TEST_F(PbrtNumbers, WhiteBalanceMakesItsDaylightWhite) {
  const auto neutral = pbrt_white_balance(6500);
  for (size_t i = 0; i < 3; ++i)
    for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(neutral[i][k], i == k ? 1 : 0, 2e-3);
  const auto warm = pbrt_white_balance(4000);
  // CIE daylight of 4000 * 1.4388 / 1.4380 K: x = 0.382247, y = -3 x^2 + 2.87 x - 0.275, in linear Rec. 709.
  const double x = 0.382247, y = -3 * x * x + 2.87 * x - 0.275, xyz[3] = {x / y, 1, (1 - x - y) / y};
  const double rgb[3] = {3.240479 * xyz[0] - 1.537150 * xyz[1] - 0.498535 * xyz[2],
                         -0.969256 * xyz[0] + 1.875991 * xyz[1] + 0.041556 * xyz[2],
                         0.055648 * xyz[0] - 0.204043 * xyz[1] + 1.057311 * xyz[2]};
  for (size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(warm[i][0] * rgb[0] + warm[i][1] * rgb[1] + warm[i][2] * rgb[2], 1, 2e-3) << i;
  const double white[3] = {warm[0][0] + warm[0][1] + warm[0][2], warm[1][0] + warm[1][1] + warm[1][2],
                           warm[2][0] + warm[2][1] + warm[2][2]};
  EXPECT_LT(white[0], 0.9);
  EXPECT_GT(white[2], 1.5);
  // Below 4000 K: black bodies. That of 2855.5 K is the CIE's illuminant A, with chromaticity (0.44757, 0.40745).
  const auto lamp = pbrt_white_balance(2855.5 * 1.4380 / 1.4388);
  const double a[3] = {0.44757 / 0.40745, 1, 0.14498 / 0.40745};
  double sum[3] = {};
  const double to_rgb[3][3] = {
      {3.240479, -1.537150, -0.498535}, {-0.969256, 1.875991, 0.041556}, {0.055648, -0.204043, 1.057311}};
  for (size_t i = 0; i < 3; ++i)
    for (size_t k = 0; k < 3; ++k)
      for (size_t l = 0; l < 3; ++l) sum[i] += lamp[i][k] * to_rgb[k][l] * a[l];
  for (const double value : sum) EXPECT_NEAR(value, 1, 3e-3);
}

/// film.h, RGBFilm: the white balance is applied to samples, and so to their mean.
TEST_F(PbrtNumbers, WhiteBalanceChangesWhatTheFilmRecords) {
  const std::string view = R"(
PixelFilter "box"
Integrator "path" "integer maxdepth" 2
Camera "perspective"
WorldBegin
LightSource "infinite" "rgb L" [ .3 .6 .9 ]
Material "diffuse" "rgb reflectance" [ .9 .5 .1 ]
Shape "sphere" "float radius" 2
Shape "disk" "float height" 5 "float radius" 3
)";
  const std::string size = "Film \"rgb\" \"integer xresolution\" 8 \"integer yresolution\" 6 ";
  const LoadedScene plain = load(size + view), balanced = load(size + "\"float whitebalance\" 3500" + view);
  EXPECT_EQ(warnings(balanced), warnings(plain));
  EXPECT_FALSE(plain.scene->has_film_response());
  ASSERT_TRUE(balanced.scene->has_film_response());
  const auto m = pbrt_white_balance(3500);
  const Spectrum radiance(0.2f, 0.7f, 0.4f), recorded = balanced.scene->on_film(radiance);
  for (int i = 0; i < 3; ++i) {
    const auto& row = m[static_cast<size_t>(i)];
    EXPECT_NEAR(recorded[i], row[0] * radiance.r + row[1] * radiance.g + row[2] * radiance.b, 1e-5) << i;
  }
  const ConvertedScene converted = convert_scene(folder_.file("scene.pbrt"), folder_.file("out.xml"));
  ASSERT_FALSE(converted.warnings.empty());
  EXPECT_TRUE(contains(converted.warnings.back(), "the film 'hdrfilm' gets the parameter 'response'"));
  write("out.xml", converted.document.xml);
  EXPECT_EQ(load_scene(folder_.file("out.xml")).scene->on_film(radiance), recorded);
}

/// lights.cpp: PointLight, SpotLight, DistantLight and Light::Create.
TEST_F(PbrtNumbers, PowerAndIlluminanceAreThoseGiven) {
  const LoadedScene scene = world(R"(
LightSource "point" "float power" 100
LightSource "distant" "float illuminance" 10 "point3 to" [ 0 -1 0 ]
LightSource "infinite" "float illuminance" 5
LightSource "spot" "float power" 7 "float coneangle" 40 "float conedeltaangle" 10
)");
  const auto& lights = scene.scene->emitters();
  ASSERT_EQ(lights.size(), 4u);
  const auto at = [&](size_t i) { return lights[i]->sample_towards({0, -1, 0.3f}, {0.5f, 0.5f}, 0.5f); };
  EXPECT_NEAR(lights[0]->power().g, 100, 1e-3f);
  EXPECT_NEAR(lights[3]->power().g, 7, 1e-3f);
  EXPECT_NEAR(at(1).wi.y, 1, 1e-6f);
  EXPECT_NEAR(scene.scene->environment()->environment({0, 0, 1}).radiance.g, 5 / kPi, 1e-5f);
}

/// materials.h: DiffuseMaterial clamps its reflectance; textures.cpp: images used as reflectances are clamped before
/// other textures scale them; paramdict.cpp: colours above 1 are errors.
TEST_F(PbrtNumbers, ReflectancesAreAtMost1) {
  write_quarters();
  const auto expect = [&](const std::string& textures, float expected) {
    const LoadedScene scene = world(textures + R"(
Material "diffuse" "texture reflectance" "t"
Shape "bilinearmesh" "point3 P" [ -1 -1 3  1 -1 3  -1 1 3  1 1 3 ]
)");
    EXPECT_NEAR(reflectance(scene, {}, {0.5f, 0.5f, 3}), expected, 1e-5f) << textures;
  };
  const std::string image = "\"imagemap\" \"string filename\" \"quarters.png\" \"string filter\" \"point\"";
  const float x = texel(1, 1);  // 0.6038
  expect("Texture \"t\" \"spectrum\" " + image, x);
  expect("Texture \"t\" \"spectrum\" " + image + " \"float scale\" 3", 1);
  const std::string bright = "Texture \"b\" \"spectrum\" " + image + " \"float scale\" 3\n";
  expect(bright + "Texture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"b\" \"float scale\" 0.5", 0.5f);
  expect("Texture \"b\" \"spectrum\" " + image +
             "\nTexture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"b\" \"float "
             "scale\" 3",
         1);
  // Textures are not clamped between images and materials.
  expect("Texture \"b\" \"spectrum\" " + image +
             "\nTexture \"c\" \"spectrum\" \"scale\" \"texture tex\" \"b\" \"float scale\" 3"
             "\nTexture \"t\" \"spectrum\" \"scale\" \"texture tex\" \"c\" \"float scale\" 0.4",
         1.2f * x);
  expect(bright + "Texture \"t\" \"spectrum\" \"checkerboard\" \"texture tex1\" \"b\" \"texture tex2\" \"b\"", 1);
  // What is used otherwise is not clamped: the scale of an image of sigma_a.
  const LoadedScene hair = world(bright + R"(
Material "hair" "texture sigma_a" "b"
Shape "curve" "point3 P" [ -1 0 3  0 0 3  0 0 3  1 0 3 ] "float width" .5
)");
  EXPECT_EQ(hair.scene->n_shapes(), 1u);
  EXPECT_TRUE(
      contains(errors("WorldBegin\nMaterial \"diffuse\" \"rgb reflectance\" [ .5 1.5 .5 ]\nShape \"sphere\"\n"),
               "parameter 'reflectance' of Material \"diffuse\" is the colour 0.5, 1.5, 0.5; expected at most 1"));
}

/// shapes.h: Sphere, Disk and Cylinder::InteractionFromIntersection, Triangle (default uv), and bilinear patches.
TEST_F(PbrtNumbers, TexturesLieAsInPbrt) {
  write_quarters();
  const float kTau = 2 * kPi;
  for (const char* transform : {"", "Scale 1 1 -1", "Scale -1 1 1", "ReverseOrientation\nScale 1 -1 1",
                                "ReverseOrientation", "Rotate 200 1 .3 2", "Rotate 100 1 2 3\nScale 1 1 -1"}) {
    const LoadedScene sphere = world(std::string(transform) + "\n" + kTexture + "Shape \"sphere\"\n");
    const LoadedScene disk = world(std::string(transform) + "\n" + kTexture + "Shape \"disk\" \"float radius\" 2\n");
    const LoadedScene cylinder =
        world(std::string(transform) + "\n" + kTexture + "Shape \"cylinder\" \"float zmin\" -2 \"float zmax\" 2\n");
    const LoadedScene triangle =
        world(std::string(transform) + "\n" + kTexture +
              "Shape \"trianglemesh\" \"point3 P\" [ 0 0 0  4 0 0  0 4 0 ] \"integer indices\" [ 0 1 2 ]\n");
    write("t.ply",
          "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face "
          "1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n4 0 0\n0 4 0\n3 0 1 2\n");
    const LoadedScene ply =
        world(std::string(transform) + "\n" + kTexture + "Shape \"plymesh\" \"string filename\" \"t.ply\"\n");
    // Where a point of the shape's own space lies.
    const auto placed = [&](float x, float y, float z) {
      const std::string t = transform;
      Transform m;
      if (t.find("Rotate 200") != t.npos) m = Transform::rotate({1, .3f, 2}, 200);
      if (t.find("Rotate 100") != t.npos) m = Transform::rotate({1, 2, 3}, 100);
      if (t.find("Scale 1 1 -1") != t.npos) m = m * Transform::scale({1, 1, -1});
      if (t.find("Scale -1 1 1") != t.npos) m = m * Transform::scale({-1, 1, 1});
      if (t.find("Scale 1 -1 1") != t.npos) m = m * Transform::scale({1, -1, 1});
      return m.point({x, y, z});
    };
    for (int i = 0; i < 2; ++i)
      for (int k = 0; k < 2; ++k) {
        // (u, v) = (0.25 + i / 2, 0.3 + k / 2), turned into points by pbrt's formulas.
        const float u = 0.25f + 0.5f * static_cast<float>(i), v = 0.3f + 0.45f * static_cast<float>(k);
        const float phi = kTau * u, theta = kPi * (1 - v);
        const Vec3 s = placed(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
        EXPECT_NEAR(reflectance(sphere, s * 3, s), texel(i, k), 1e-5f) << transform << " sphere " << i << k;
        const float r = 2 * (1 - v);
        const Vec3 above = placed(r * std::cos(phi), r * std::sin(phi), 1);
        EXPECT_NEAR(reflectance(disk, above, placed(r * std::cos(phi), r * std::sin(phi), 0)), texel(i, k), 1e-5f)
            << transform << " disk " << i << k;
        const Vec3 around = placed(3 * std::cos(phi), 3 * std::sin(phi), -2 + 4 * v);
        EXPECT_NEAR(reflectance(cylinder, around, placed(0, 0, -2 + 4 * v)), texel(i, k), 1e-5f)
            << transform << " cylinder " << i << k;
        // Corners (0, 0), (1, 0), (1, 1): the point is 4 (u - v, v).
        if (v >= u) continue;
        for (const LoadedScene* mesh : {&triangle, &ply})
          EXPECT_NEAR(reflectance(*mesh, placed(4 * (u - v), 4 * v, 1), placed(4 * (u - v), 4 * v, 0)), texel(i, k),
                      1e-5f)
              << transform << " triangle " << i << k;
      }
  }
  const LoadedScene patch = world(kTexture + "Shape \"bilinearmesh\" \"point3 P\" [ 0 0 3  4 0 3  0 4 3  4 4 3 ]\n");
  for (int i = 0; i < 4; ++i) {
    const Vec3 p{1 + 2 * static_cast<float>(i % 2), 1 + 2 * static_cast<float>(i / 2), 3};
    EXPECT_NEAR(reflectance(patch, {p.x, p.y, 0}, p), texel(i % 2, i / 2), 1e-5f) << i;
  }
}

/// Rough metal on a disk: roughness along u is around the centre.
TEST_F(PbrtNumbers, DisksAreRoughAroundTheirCentre) {
  const LoadedScene scene = world(R"(
Material "conductor" "float uroughness" 0.01 "float vroughness" 0.25
Shape "disk"
)");
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{0.5f, 0, 1}, {0, 0, -1}}, hit));
  // Seen from above at x = 0.5: u runs along y, v along x, where the highlight is broad.
  const auto value = [&](const Vec3& world_wi) {
    Arena arena;
    const Vec3 wo = hit.frame.to_local({0, 0, 1});
    return hit.shape->bsdf()
        ->bind(hit, wo.z > 0, TransportMode::kRadiance, arena)
        ->eval(wo, hit.frame.to_local(normalize(world_wi)))
        .value.g;
  };
  EXPECT_GT(value({0.5f, 0, 1}), 10 * value({0, 0.5f, 1}));
}

/// shapes.h: flipNormal = reverseOrientation ^ transformSwapsHandedness for quadrics; triangles turn with their
/// vertices; primitive.cpp and interaction.h: the medium on the side of the normal is the outer one.
TEST_F(PbrtNumbers, MirroredQuadricsTurnInsideOut) {
  const auto inside = [&](const std::string& transform, const std::string& shape) {
    const LoadedScene scene = world("MakeNamedMedium \"m\" \"string type\" \"homogeneous\"\n" + transform +
                                    "\nMaterial \"interface\"\nMediumInterface \"m\" \"\"\n" + shape);
    SurfaceHit hit;
    EXPECT_TRUE(scene.scene->intersect({{0.1f, 0.1f, -5}, {0, 0, 1}}, hit));
    return hit.shape->medium_towards(hit.ng, {0, 0, 1}) != nullptr;
  };
  const std::string sphere = "Shape \"sphere\"\n";
  EXPECT_TRUE(inside("", sphere));
  EXPECT_FALSE(inside("ReverseOrientation", sphere));
  EXPECT_FALSE(inside("Scale 1 1 -1", sphere));
  EXPECT_TRUE(inside("ReverseOrientation\nScale 1 1 -1", sphere));
  // Towards -z stands the normal of this triangle: what lies behind it, seen from there, is inside.
  const std::string triangle =
      "Shape \"trianglemesh\" \"point3 P\" [ -1 -1 0  1 2 0  2 -1 0 ] \"integer indices\" [ 0 1 2 ]\n";
  EXPECT_TRUE(inside("", triangle));
  EXPECT_FALSE(inside("ReverseOrientation", triangle));
  EXPECT_TRUE(inside("Scale -1 1 1\nTranslate -.2 0 0", triangle));
  EXPECT_FALSE(inside("ReverseOrientation\nScale -1 1 1\nTranslate -.2 0 0", triangle));
}

/// The reflectance of glass at normal incidence, ((n - 1) / (n + 1))^2: spectrum.cpp, at 589 nm.
TEST_F(PbrtNumbers, GlassesHaveTheirIndex) {
  const std::pair<const char*, double> glasses[] = {{"BK7", 1.5167},   {"BAF10", 1.6699}, {"FK51A", 1.4865},
                                                    {"LASF9", 1.8500}, {"F5", 1.6725},    {"F10", 1.7281},
                                                    {"F11", 1.7845},   {"SF11", 1.7845}};
  for (const auto& [name, n] : glasses) {
    const LoadedScene scene = world("Material \"dielectric\" \"spectrum eta\" \"glass-" + std::string(name) +
                                    "\"\nTranslate 0 0 3\nShape \"sphere\"\n");
    SurfaceHit hit;
    ASSERT_TRUE(scene.scene->intersect({{0, 0, 0}, {0, 0, 1}}, hit));
    Arena arena;
    const BsdfClosure* glass = hit.shape->bsdf()->bind(hit, true, TransportMode::kRadiance, arena);
    const BsdfSample s = glass->sample({0, 0, 1}, 0, {0.5f, 0.5f});
    ASSERT_EQ(s.flags & kDeltaReflection, uint32_t{kDeltaReflection});
    EXPECT_NEAR(s.weight.g * s.pdf, std::pow((n - 1) / (n + 1), 2), 1e-4) << name;
    EXPECT_TRUE(contains(warnings(scene), "refracts all colours alike"));
  }
  EXPECT_TRUE(contains(errors("WorldBegin\nMaterial \"dielectric\" \"spectrum eta\" \"glass-F2\"\nShape \"sphere\"\n"),
                       "names the spectrum 'glass-F2', which is neither one of pbrt's nor a file"));
}

/// Reflectance of metals at normal incidence. Expected: integrals over pbrt's spectra (spectrum.cpp) of ((n - 1)^2 +
/// k^2) / ((n + 1)^2 + k^2) under D65, converted to Rec. 709; the RGB
/// indices come within 0.05.
TEST_F(PbrtNumbers, MetalsReflectTheirColours) {
  struct Expected {
    const char* name;
    double rgb[3];
  };
  const Expected expected[] = {{"Ag", {0.972, 0.960, 0.915}},   {"Al", {0.913, 0.921, 0.924}},
                               {"Au", {1.022, 0.782, 0.344}},   {"Cu", {0.955, 0.638, 0.538}},
                               {"CuZn", {0.910, 0.778, 0.423}}, {"MgO", {0.072, 0.073, 0.075}},
                               {"TiO2", {0.232, 0.245, 0.273}}};
  for (const Expected& metal : expected) {
    const std::string name = metal.name;
    const LoadedScene scene =
        world("Material \"conductor\" \"spectrum eta\" \"metal-" + name + "-eta\" \"spectrum k\" \"metal-" + name +
              "-k\"\nTranslate 0 0 3\nShape \"sphere\"\n");
    SurfaceHit hit;
    ASSERT_TRUE(scene.scene->intersect({{0, 0, 0}, {0, 0, 1}}, hit));
    Arena arena;
    const BsdfClosure* model = hit.shape->bsdf()->bind(hit, true, TransportMode::kRadiance, arena);
    const BsdfSample s = model->sample({0, 0, 1}, 0, {0.5f, 0.5f});
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(s.weight[c], metal.rgb[c], 0.05) << name << " " << c;
  }
  EXPECT_TRUE(
      contains(errors("WorldBegin\nMaterial \"conductor\" \"spectrum eta\" \"metal-Cr-eta\"\nShape \"sphere\"\n"),
               "names the spectrum 'metal-Cr-eta', which is neither one of pbrt's nor a file"));
}

/// shapes.h: triangles without normals are flat.
TEST_F(PbrtNumbers, PlyMeshesWithoutNormalsAreFlat) {
  write("roof.ply",
        "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face "
        "2\nproperty list uchar int vertex_indices\nend_header\n-1 0 3\n0 1 2\n0 -1 2\n1 0 3\n3 0 1 2\n3 1 3 2\n");
  const LoadedScene scene = world("Shape \"plymesh\" \"string filename\" \"roof.ply\"\n");
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{0.1f, 0, 0}, {0, 0, 1}}, hit));
  EXPECT_NEAR(std::abs(dot(hit.frame.n, hit.ng)), 1, 1e-6f);
  EXPECT_NEAR(std::abs(hit.ng.x), std::sqrt(0.5f), 1e-5f);
}

/// image.cpp, Image::Read: the encoding is read for PNG files alone.
TEST_F(PbrtNumbers, OnlyPngFilesMayBeLinear) {
  write_quarters();
  std::string ppm = "P6\n1 1\n255\n";
  ppm.append(3, static_cast<char>(102));
  write("grey.ppm", ppm);
  const auto value = [&](const std::string& file, const std::string& more) {
    const LoadedScene scene = world("Texture \"t\" \"spectrum\" \"imagemap\" \"string filename\" \"" + file +
                                    "\" \"string filter\" \"point\" " + more + R"(
Material "diffuse" "texture reflectance" "t"
Shape "bilinearmesh" "point3 P" [ -1 -1 3  1 -1 3  -1 1 3  1 1 3 ]
)");
    return reflectance(scene, {}, {0.5f, -0.5f, 3});
  };
  EXPECT_NEAR(value("quarters.png", ""), srgb_to_linear(0.4f), 1e-5f);
  EXPECT_NEAR(value("quarters.png", "\"string encoding\" \"linear\""), 0.4f, 1e-5f);
  EXPECT_NEAR(value("grey.ppm", ""), srgb_to_linear(0.4f), 1e-5f);
  EXPECT_NEAR(value("grey.ppm", "\"string encoding\" \"linear\""), srgb_to_linear(0.4f), 1e-5f);
}

/// mipmap.cpp: as a number, a colour is the mean of its channels. Mitsuba takes the luminance, so that a converted
/// scene has the means as an image.
TEST_F(PbrtNumbers, ImagesAreTheirMeanAsNumbers) {
  const std::vector<unsigned char> bytes = encode_png(1, 1, std::vector<uint8_t>{255, 102, 0});
  write("colour.png", {bytes.begin(), bytes.end()});
  const float mean = (1 + srgb_to_linear(0.4f)) / 3;
  const LoadedScene scene = world(R"(
Texture "t" "float" "imagemap" "string filename" "colour.png"
MakeNamedMaterial "black" "string type" "diffuse" "rgb reflectance" [ 0 0 0 ]
MakeNamedMaterial "white" "string type" "diffuse" "rgb reflectance" [ 1 1 1 ]
Material "mix" "string materials" [ "black" "white" ] "texture amount" "t"
Shape "bilinearmesh" "point3 P" [ -1 -1 3  1 -1 3  -1 1 3  1 1 3 ]
)");
  EXPECT_NEAR(reflectance(scene, {}, {0.5f, 0.5f, 3}), mean, 1e-5f);
  const ConvertedScene converted = convert_scene(folder_.file("scene.pbrt"), folder_.file("out.xml"));
  EXPECT_FALSE(contains(converted.document.xml, "alpha_or_mean"));
  write("out.xml", converted.document.xml);
  std::filesystem::create_directory(folder_.file("out-files"));
  for (const SceneDocumentFile& part : converted.document.files) write(part.path, std::string(part.bytes));
  EXPECT_NEAR(reflectance(load_scene(folder_.file("out.xml")), {}, {0.5f, 0.5f, 3}), mean, 1e-5f);
}

/// integrators.cpp: of those that estimate the same picture, the path tracers without volumes leave media out.
TEST_F(PbrtNumbers, IntegratorsEstimateTheSamePicture) {
  const std::string media = R"(MakeNamedMedium "m" "string type" "homogeneous"
MediumInterface "" "m"
Camera "perspective"
WorldBegin
Material "interface"
MediumInterface "m" ""
Shape "sphere" "float radius" 3
)";
  for (const char* with : {"volpath", "simplevolpath", "mlt"}) {
    const LoadedScene scene = load("Integrator \"" + std::string(with) + "\"\n" + media);
    EXPECT_TRUE(scene.scene->camera_medium()) << with;
    EXPECT_FALSE(contains(warnings(scene), "leaves media out"));
  }
  for (const char* without : {"path", "simplepath", "sppm"}) {
    const LoadedScene scene = load("Integrator \"" + std::string(without) + "\"\n" + media);
    EXPECT_FALSE(scene.scene->camera_medium()) << without;
    EXPECT_TRUE(contains(warnings(scene), "this integrator of pbrt leaves media out"));
    SurfaceHit hit;
    ASSERT_TRUE(scene.scene->intersect({{0, 0, 0}, {0, 0, 1}}, hit));
    EXPECT_EQ(hit.shape->medium_towards(hit.ng, {0, 0, -1}), nullptr);
  }
  for (const char* other : {"ambientocclusion", "ao", "function", "metropolis"})
    EXPECT_TRUE(contains(errors("Integrator \"" + std::string(other) + "\"\nWorldBegin\n"),
                         "Integrator \"" + std::string(other) + "\" is not supported; supported: integrators 'bdpt'"));
}

TEST_F(PbrtNumbers, BlanksAroundParametersAreSkipped) {
  const LoadedScene scene = world("Shape \"sphere\" \"  float \tradius \" .5\n");
  SurfaceHit hit;
  ASSERT_TRUE(scene.scene->intersect({{0, 0, 3}, {0, 0, -1}}, hit));
  EXPECT_NEAR(hit.p.z, 0.5f, 1e-5f);
}

/// film.cpp: FilmBaseParameters; filters.cpp: TriangleFilter::Create; cameras.cpp: PerspectiveCamera::Create.
TEST_F(PbrtNumbers, DefaultsOfTheViewArePbrts) {
  const LoadedScene scene = load(R"(Film "rgb" "integer xresolution" 100 "integer yresolution" 50
  "float cropwindow" [ .75 .25 0 2 ] "integer pixelbounds" [ 1 2 3 4 ]
PixelFilter "triangle"
Camera "perspective" "float halffov" 20
WorldBegin
Shape "sphere" "float radius" .001
)");
  EXPECT_EQ(scene.filter.kind, FilterKind::kTent);
  EXPECT_EQ(scene.filter.radius, 2);
  EXPECT_EQ(scene.crop_x, 25);
  EXPECT_EQ(scene.crop_width, 50);
  EXPECT_EQ(scene.crop_height, 50);
  // The shorter side is 40 degrees wide; a tiny sphere around the camera is seen.
  EXPECT_NEAR(scene.scene->camera().ray({50, 0}, {}).d.y, std::sin(20 * kPi / 180), 1e-5f);
  SurfaceHit hit;
  EXPECT_TRUE(scene.scene->intersect(scene.scene->camera().ray({50, 25}, {}), hit));
}

}  // namespace
}  // namespace covary::pbrt_numbers_test
