// SPDX-License-Identifier: Apache-2.0
// Scenes of pbrt-v3: its names, defaults and formulas (src/materials, src/lights, src/cameras of pbrt-v3).
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>

#include "core/arena.h"
#include "io/load_scene.h"
#include "support/files.h"

namespace covary::pbrt_version_3_test {
namespace {

using test_support::contains;

class Pbrt3 : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& bytes) {
    std::ofstream(folder_.file(name), std::ios::binary) << bytes;
  }
  LoadedScene world(const std::string& text) {
    write("scene.pbrt",
          "Camera \"perspective\" \"float shutterclose\" 0\n" + film_ + "WorldBegin\n" + text + "WorldEnd\n");
    return load_scene(folder_.file("scene.pbrt"));
  }
  /// BSDF value over cosine, seen from (0, 0, 1), of a material on a disk.
  Spectrum brdf(const std::string& material, const Vec3& wi) {
    const LoadedScene scene = world(material + "\nShape \"disk\"\n");
    SurfaceHit hit;
    EXPECT_TRUE(scene.scene->intersect({{0.2f, 0.1f, 5}, {0, 0, -1}}, hit));
    Arena arena;
    const Vec3 wo = hit.frame.to_local({0, 0, 1}), in = hit.frame.to_local(normalize(wi));
    return hit.shape->bsdf()->bind(hit, wo.z > 0, TransportMode::kRadiance, arena)->eval(wo, in).value / std::abs(in.z);
  }
  std::string film_ = "Film \"image\" \"integer xresolution\" [ 40 ] \"integer yresolution\" [ 20 ]\n";
  test_support::TemporaryFolder folder_;
};

TEST_F(Pbrt3, ScenesAreReadWithTheirNames) {
  const LoadedScene scene = world(R"(
AttributeBegin
Texture "checks" "color" "checkerboard" "float uscale" [ 8 ] "color tex1" [ .1 .1 .1 ] "rgb tex2" [ .8 .8 .8 ]
Material "matte" "texture Kd" "checks" "float sigma" 20
Shape "trianglemesh" "point P" [ -9 -9 0  9 -9 0  0 9 0 ] "integer indices" [ 0 1 2 ] "float st" [ 0 0 1 0 1 1 ]
AttributeEnd
MakeNamedMaterial "gold" "string type" [ "metal" ] "spectrum eta" "spds/Au.eta.spd" "spectrum k" "spds/Au.k.spd"
NamedMaterial "gold"
Translate 0 0 3
Shape "sphere" "float radius" [ 1 ]
LightSource "distant" "point from" [ 0 0 9 ] "blackbody L" [ 3000 2 ]
)");
  EXPECT_EQ(scene.scene->n_shapes(), 2u);
  EXPECT_EQ(scene.width, 40);
  ASSERT_EQ(scene.scene->emitters().size(), 1u);
  // Not exposed, though the shutter is never open; a black body is scaled to a maximum of 1, at 966 nm here, times 2:
  // its Y is the sum of Planck's law with the CIE's observer, about 0.107 of the maximum.
  const EmitterSample sun = scene.scene->emitters()[0]->sample_towards({0, 0, 0}, {}, 0);
  double y = 0, weight = 0;  // y-bar as Gaussians (Wyman et al. 2013)
  for (int nm = 380; nm <= 780; ++nm) {
    const auto gauss = [&](double a, double m, double s1, double s2) {
      const double t = (nm - m) * (nm < m ? s1 : s2);
      return a * std::exp(-t * t / 2);
    };
    const double bar = gauss(0.821, 568.8, 0.0213, 0.0247) + gauss(0.286, 530.9, 0.0613, 0.0322);
    const auto planck = [](double w) { return std::pow(w, -5) / std::expm1(1.438777e7 / (w * 3000)); };
    y += bar * planck(nm) / planck(2.8977721e6 / 3000), weight += bar;
  }
  EXPECT_NEAR(luminance(sun.radiance), 2 * y / weight, 0.02 * 2 * y / weight);
}

/// plastic.cpp, matte.cpp, mirror.cpp, translucent.cpp, mixmat.cpp.
TEST_F(Pbrt3, MaterialsHaveTheirFormulas) {
  const Vec3 off(0.8f, 0, 0.6f);  // far from the mirror direction
  EXPECT_NEAR(brdf("Material \"matte\"", off).g, 0.5f / kPi, 1e-5f);
  EXPECT_NEAR(brdf("Material \"matte\" \"xyz Kd\" [ 0.9505 1 1.089 ]", off).g, 1 / kPi, 2e-3f);  // D65's white
  EXPECT_NEAR(brdf("Material \"plastic\" \"rgb Kd\" [ .2 .4 .6 ] \"rgb Ks\" [ 0 0 0 ]", off).b, 0.6f / kPi, 1e-5f);
  const Spectrum sheet = brdf("Material \"translucent\" \"rgb Kd\" [ .4 .4 .4 ] \"rgb transmit\" [ .25 .5 1 ]", -off);
  EXPECT_NEAR(sheet.r, 0.1f / kPi, 1e-5f);
  // The amount is that of the first material.
  EXPECT_NEAR(brdf(R"(MakeNamedMaterial "a" "string type" "matte" "rgb Kd" [ .8 .8 .8 ]
MakeNamedMaterial "b" "string type" "matte" "rgb Kd" [ 0 0 0 ]
Material "mix" "string namedmaterial1" "a" "string namedmaterial2" "b" "rgb amount" [ .25 .25 .25 ])",
                   off)
                  .g,
              0.2f / kPi, 1e-5f);
  // microfacet.h: alpha of the default roughness 0.1 is 0.4617: of GGX at normal incidence, seen from above, D / 4
  // times the metal's reflectance, 1 / (4 pi alpha^2).
  const float mirror =
      brdf(
          "Material \"metal\" \"float roughness\" .1 \"spectrum eta\" [ 400 1e-3 700 1e-3 ] \"spectrum "
          "k\" [ 400 1000 700 1000 ]",
          {0, 0, 1})
          .g;
  EXPECT_NEAR(mirror, 1 / (4 * kPi * 0.46168f * 0.46168f), 0.01f);
}

/// api.cpp: pbrtNamedMaterial reports the name and goes on.
TEST_F(Pbrt3, UnknownMaterialsAreDefaults) {
  EXPECT_NEAR(brdf("NamedMaterial \"nothing\"", {0.8f, 0, 0.6f}).g, 0.5f / kPi, 1e-5f);
}

TEST_F(Pbrt3, EveryMaterialIsRead) {
  for (const char* type : {"disney", "fourier", "glass", "hair", "kdsubsurface", "matte", "metal", "mirror", "none",
                           "plastic", "substrate", "subsurface", "translucent", "uber"}) {
    const std::string material = std::string("Material \"") + type + "\"\nShape \"sphere\"\n";
    EXPECT_EQ(world(material).scene->n_shapes(), 1u) << type;
  }
}

/// infinite.cpp: (phi / 2 pi, theta / pi) of the light's own directions, z up.
TEST_F(Pbrt3, SkiesHaveLongitudeAndLatitude) {
  std::string text = "PF\n8 4\n-1\n";
  for (int y = 3; y >= 0; --y)
    for (int x = 0; x < 8; ++x)
      for (int c = 0; c < 3; ++c) {
        const float value = static_cast<float>(x + 10 * y);
        text.append(reinterpret_cast<const char*>(&value), 4);
      }
  write("sky.pfm", text);
  const LoadedScene scene = world(
      "Rotate 90 1 0 0\nLightSource \"infinite\" \"string mapname\" \"sky.pfm\" \"rgb L\" [ 2 2 2 ]\nShape "
      "\"sphere\"\n");
  for (int x = 0; x < 8; ++x) {
    const float phi = kTwoPi * (static_cast<float>(x) + 0.5f) / 8, theta = kPi / 3;  // the second row lies there
    const Vec3 local{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
    const Vec3 d = Transform::rotate({1, 0, 0}, 90).vector(local);
    EXPECT_NEAR(scene.scene->environment()->environment(d).radiance.g, 2 * static_cast<float>(x + 10), 0.05f) << x;
  }
}

TEST_F(Pbrt3, ShapesOfVersion3AreRead) {
  const auto height = [&](const std::string& shape, float x, float y) {
    SurfaceHit hit;
    return world(shape).scene->intersect({{x, y, 9}, {0, 0, -1}}, hit) ? hit.p.z : -1000;
  };
  EXPECT_NEAR(height("Shape \"cone\" \"float height\" 2\n", 0.25f, 0), 1.5f, 1e-3f);
  EXPECT_NEAR(height("Shape \"paraboloid\" \"float radius\" 2 \"float zmax\" 3\n", 1, 0), 3 * 0.25f, 1e-3f);
  EXPECT_NEAR(height("Shape \"hyperboloid\" \"point p1\" [ 1 0 0 ] \"point p2\" [ 1 1 1 ]\n", 1.118f, 0), 0.5f, 5e-3f);
  EXPECT_NEAR(height("Shape \"heightfield\" \"integer nu\" 2 \"integer nv\" 2 \"float Pz\" [ 0 1 0 1 ]\n", 0.25f, 0.5f),
              0.25f, 1e-5f);
  // A quarter of a cylinder, by weights exactly: u along the arc from (1, 0, 0) to (0, 0, 1), v along y.
  EXPECT_NEAR(
      height("Shape \"nurbs\" \"integer nu\" 3 \"integer nv\" 2 \"integer uorder\" 3 \"integer vorder\" 2 "
             "\"float uknots\" [ 0 0 0 1 1 1 ] \"float vknots\" [ 0 0 1 1 ] \"float Pw\" [ 1 0 0 1  .70710678 0 "
             ".70710678 .70710678  0 0 1 1  1 2 0 1  .70710678 1.41421356 .70710678 .70710678  0 2 1 1 ]\n",
             0.6f, 1),
      0.8f, 1e-3f);
  EXPECT_NEAR(
      height("Shape \"nurbs\" \"integer nu\" 2 \"integer nv\" 2 \"integer uorder\" 2 \"integer vorder\" 2 "
             "\"float uknots\" [ 0 0 1 1 ] \"float vknots\" [ 0 0 1 1 ] \"point P\" [ 0 0 0  1 0 1  0 1 0  1 1 3 "
             "]\n",
             0.5f, 0.5f),
      1, 1e-3f);
}

}  // namespace
}  // namespace covary::pbrt_version_3_test
