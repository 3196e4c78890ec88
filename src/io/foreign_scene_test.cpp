// SPDX-License-Identifier: Apache-2.0
// Scenes as others write them: Mitsuba's own writer, versions 0.x, files of other systems, research forks.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/arena.h"
#include "io/load_scene.h"
#include "scene/lobed_filter.h"
#include "support/files.h"

namespace covary::foreign_scene_test {
namespace {

namespace fs = std::filesystem;
using test_support::contains;
using test_support::message_of;

const std::string kCamera =
    "<sensor type=\"perspective\"><transform name=\"to_world\"><lookat origin=\"0 0 5\" target=\"0 0 0\" up=\"0 1 0\"/>"
    "</transform></sensor>\n";
const std::string kMesh = "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n";

class ForeignScene : public ::testing::Test {
 protected:
  void write(const std::string& name, const std::string& text) {
    fs::create_directories(fs::path(folder_.file(name)).parent_path());
    std::ofstream(folder_.file(name), std::ios::binary) << text;
  }
  LoadedScene load(const std::string& body, const LoadOptions& options = {}, const char* version = "3.0.0") {
    write("scene.xml", fmt::format("<scene version=\"{}\">\n{}{}</scene>\n", version, kCamera, body));
    return load_scene(folder_.file("scene.xml"), options);
  }
  LoadedScene load_old(const std::string& body) {
    LoadedScene scene = load(body, {}, "0.6.0");
    return scene;
  }
  std::string errors(const std::string& body) {
    return message_of([&] { load(body); });
  }
  static LoadOptions ignoring() {
    LoadOptions options;
    options.ignore_unknown = true;
    return options;
  }
  static std::string warnings(const LoadedScene& scene) {
    std::string text;
    for (const std::string& warning : scene.warnings) text += warning + "\n";
    return text;
  }
  /// Radiance of the light on the square, towards the camera.
  static Spectrum emitted(const LoadedScene& scene) {
    const SurfaceHit hit = hit_at_centre(scene);
    return hit.shape->emitter()->surface_radiance(hit, {0, 0, 1});
  }
  static SurfaceHit hit_at_centre(const LoadedScene& scene) {
    SurfaceHit hit;
    EXPECT_TRUE(scene.scene->intersect({{0.1f, 0.2f, 5}, {0, 0, -1}}, hit));
    return hit;
  }
  /// f cos of the square's BSDF.
  static Spectrum scattered(const LoadedScene& scene, const Vec3& wo, const Vec3& wi) {
    const SurfaceHit hit = hit_at_centre(scene);
    Arena arena;
    return hit.shape->bsdf()->bind(hit, true, TransportMode::kRadiance, arena)->eval(wo, wi).value;
  }

  test_support::TemporaryFolder folder_;
};

void expect_colour(const Spectrum& found, const Spectrum& expected) {
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(found[c], expected[c], 1e-5f) << c;
}

/// A square with this light.
std::string lamp(const std::string& radiance) {
  return "<shape type=\"rectangle\"><emitter type=\"area\">" + radiance + "</emitter></shape>";
}

// ---- Mitsuba's own writer: mitsuba.parser.write_file() of version 3.9.1 writes colours as textures ----

TEST_F(ForeignScene, ColoursMayBeTextures) {
  expect_colour(
      emitted(load(lamp("<texture type=\"d65\" name=\"radiance\"><float name=\"scale\" value=\"2\"/></texture>"))),
      Spectrum(2));
  expect_colour(emitted(load(lamp("<texture type=\"srgb\" name=\"radiance\"><vector name=\"color\" x=\"0.1\" y=\"0.2\" "
                                  "z=\"0.3\"/></texture>"))),
                {0.1f, 0.2f, 0.3f});
  const std::string samples = "<string name=\"values\" value=\"1,1,1\"/>";
  const Spectrum regular =
      emitted(load(lamp("<texture type=\"regular\" name=\"radiance\"><integer name=\"wavelength_min\" value=\"400\"/>"
                        "<integer name=\"wavelength_max\" value=\"700\"/>" +
                        samples + "</texture>")));
  const Spectrum irregular = emitted(
      load(lamp("<texture type=\"irregular\" name=\"radiance\"><string name=\"wavelengths\" value=\"400,500,700\"/>" +
                samples + "</texture>")));
  const Spectrum plain = emitted(load(lamp("<spectrum name=\"radiance\" value=\"400:1, 500:1, 700:1\"/>")));
  expect_colour(regular, plain);
  expect_colour(irregular, plain);
}

TEST_F(ForeignScene, ConstantTexturesAreColours) {
  const LoadedScene scene = load(
      "<emitter type=\"constant\"><texture type=\"uniform\" name=\"radiance\"><float "
      "name=\"value\" value=\"0.3\"/></texture></emitter>");
  expect_colour(scene.scene->environment()->environment({0, 0, 1}).radiance, Spectrum(0.3f));
}

TEST_F(ForeignScene, D65ScalesItsTexture) {
  write("grey.pfm", std::string("PF\n1 1\n-1.0\n") + std::string("\0\0\0\x3f\0\0\0\x3f\0\0\0\x3f", 12));  // 0.5
  const std::string image = "<texture type=\"bitmap\"><string name=\"filename\" value=\"grey.pfm\"/></texture>";
  for (const auto& [scale, expected] : {std::pair("1", 0.5f), std::pair("3", 1.5f)})
    expect_colour(emitted(load(lamp(fmt::format("<texture type=\"d65\" name=\"radiance\">{}<float name=\"scale\" "
                                                "value=\"{}\"/></texture>",
                                                image, scale)))),
                  Spectrum(expected));
  expect_colour(emitted(load(lamp("<spectrum type=\"bitmap\" name=\"radiance\"><string name=\"filename\" "
                                  "value=\"grey.pfm\"/></spectrum>"))),
                Spectrum(0.5f));
}

TEST_F(ForeignScene, SpectraAtTopWaitForReferences) {
  const LoadedScene scene = load("<spectrum type=\"rgb\" id=\"c\"><rgb name=\"value\" value=\"1 2 3\"/></spectrum>" +
                                 lamp("<ref id=\"c\" name=\"radiance\"/>"));
  expect_colour(emitted(scene), {1, 2, 3});
}

TEST_F(ForeignScene, LightsMayHaveASamplingWeight) {
  const LoadedScene scene = load(lamp("<float name=\"sampling_weight\" value=\"2\"/>") +
                                 "<emitter type=\"point\"><float name=\"sampling_weight\" value=\"3\"/></emitter>");
  EXPECT_EQ(warnings(scene), "");
  EXPECT_EQ(scene.scene->emitters().size(), 2u);
}

// ---- files ----

TEST_F(ForeignScene, FilesAreAlsoSearchedWhereTheProgramRuns) {
  write("meshes/square.obj", kMesh);
  write("scenes/scene.xml",
        "<scene version=\"3.0.0\">" + kCamera +
            "<shape type=\"obj\"><string name=\"filename\" value=\"meshes/square.obj\"/></shape></scene>");
  const fs::path before = fs::current_path();
  fs::current_path(folder_.path());
  EXPECT_EQ(load_scene("scenes/scene.xml").scene->n_triangles(), 2u);
  fs::current_path(before);
}

TEST_F(ForeignScene, NamesOfOtherSystemsAreFound) {
  write("Meshes/Square.OBJ", kMesh);
  const LoadedScene scene =
      load("<shape type=\"obj\"><string name=\"filename\" value=\"meshes\\square.obj\"/></shape>");
  EXPECT_EQ(scene.scene->n_triangles(), 2u);
  EXPECT_TRUE(contains(warnings(scene), "file 'meshes\\square.obj' is read as '" + folder_.file("Meshes/Square.OBJ")));
  write("Meshes/square.obj", kMesh);  // the exact name wins
  EXPECT_EQ(warnings(load("<shape type=\"obj\"><string name=\"filename\" value=\"Meshes\\square.obj\"/></shape>")), "");
  write("Meshes/SQUARE.obj", kMesh);
  EXPECT_TRUE(contains(errors("<shape type=\"obj\"><string name=\"filename\" value=\"Meshes/sQuare.obj\"/></shape>"),
                       "file 'Meshes/sQuare.obj' not found"));  // which of three?
}

TEST_F(ForeignScene, PointersOfGitLfsAreNamed) {
  const std::string pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
  write("a.obj", pointer);
  write("a.exr", pointer);
  const std::string found = errors(
      "<shape type=\"obj\"><string name=\"filename\" value=\"a.obj\"/></shape>\n"
      "<emitter type=\"envmap\"><string name=\"filename\" value=\"a.exr\"/></emitter>");
  for (const char* name : {"scene.xml:3:19: '", "scene.xml:4:24: '"}) EXPECT_TRUE(contains(found, name));
  EXPECT_TRUE(
      contains(found, "a.obj' is a pointer of Git LFS, not the file itself; fetch the file with 'git lfs pull'"));
  write("whole.xml", pointer);
  EXPECT_TRUE(contains(message_of([&] { load_scene(folder_.file("whole.xml")); }), "is a pointer of Git LFS"));
}

TEST_F(ForeignScene, MeshesMayBeginWithAByteOrderMark) {
  write("bom.obj", "\xef\xbb\xbf" + kMesh);
  EXPECT_EQ(load("<shape type=\"obj\"><string name=\"filename\" value=\"bom.obj\"/></shape>").scene->n_triangles(), 2u);
}

// ---- numbers ----

TEST_F(ForeignScene, NumbersThatAreTooLargeAreCalledSo) {
  const auto film = [&](const char* width) {
    return message_of([&] {
      write("scene.xml",
            fmt::format("<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\">"
                        "</film><sampler type=\"independent\"><integer name=\"sample_count\" value=\"{}\"/>"
                        "</sampler></sensor></scene>",
                        width));
      load_scene(folder_.file("scene.xml"));
    });
  };
  EXPECT_TRUE(contains(film("4294967296"), "is 4294967296; it must be at most 2147483647"));
  EXPECT_TRUE(contains(film("99999999999999999999"), "'99999999999999999999' is too large"));
  EXPECT_TRUE(contains(errors("<shape type=\"sphere\"><float name=\"radius\" value=\"1e200\"/></shape>"),
                       "is 1e+200, which is too large for a float"));
  EXPECT_TRUE(contains(errors("<shape type=\"sphere\"><float name=\"radius\" value=\"1e999\"/></shape>"),
                       "'1e999' is too large"));
}

TEST_F(ForeignScene, LightsWithoutAFiniteAreaAreNamed) {
  write("point.obj", "v 0 0 0\nv 0.5 0 0\nv -0.5 0 0\nf 1 2 3\n");
  write("huge.obj", "v 0 0 0\nv 1e38 0 0\nv 0 1e38 0\nf 1 2 3\n");
  for (const auto& [name, reason] : {std::pair("point.obj", "its mesh has no triangle of positive area"),
                                     std::pair("huge.obj", "is too large for its area to be a float")}) {
    const std::string found =
        errors(fmt::format("<shape type=\"obj\"><string name=\"filename\" value=\"{}\"/><emitter "
                           "type=\"area\"/></shape>",
                           name));
    EXPECT_TRUE(contains(found, "scene.xml:3:1: shape 'obj': cannot emit light: "));
    EXPECT_TRUE(contains(found, reason));
  }
}

TEST_F(ForeignScene, CamerasMayBeFarAway) {
  write("scene.xml",
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><float name=\"far_clip\" value=\"1e10\"/>"
        "<transform name=\"to_world\"><lookat origin=\"0,1.6e7,1e8\" target=\"0,0,0\" up=\"0,1,0\"/>"
        "</transform></sensor></scene>");
  const Vec3 p = load_scene(folder_.file("scene.xml")).camera->settings().to_world.inverse().point({0, 0, 0});
  EXPECT_NEAR(p.z, std::sqrt(1e16 + 1.6e7 * 1.6e7), 100);  // the distance; floats have a spacing of 8 there
}

TEST_F(ForeignScene, ShapesMayBeScaledFlat) {
  const LoadedScene scene = load(
      "<shape type=\"rectangle\"><transform name=\"to_world\"><scale x=\"2\" y=\"3\" "
      "z=\"0\"/></transform></shape>");
  const SurfaceHit hit = hit_at_centre(scene);
  EXPECT_NEAR(hit.ng.z, 1, 1e-6f);
  EXPECT_NEAR(hit.p.z, 0, 1e-6f);
  EXPECT_TRUE(contains(errors("<shape type=\"rectangle\"><transform name=\"to_world\"><scale value=\"0\"/></transform>"
                              "</shape>"),
                       "singular"));
}

// ---- film ----

TEST_F(ForeignScene, FiltersWithNegativeLobesAreThemselves) {
  const auto filter = [&](const std::string& text) {
    write("scene.xml", "<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\">" + text +
                           "</film></sensor></scene>");
    return load_scene(folder_.file("scene.xml")).filter;
  };
  EXPECT_EQ(filter("<rfilter type=\"mitchell\"/>").lobed, &LobedFilter::mitchell(1.0f / 3, 1.0f / 3));
  EXPECT_EQ(filter("<rfilter type=\"mitchell\"><float name=\"A\" value=\"0\"/><float name=\"B\" value=\"0.5\"/>"
                   "</rfilter>")
                .lobed->value(0.3),
            LobedFilter::catmull_rom().value(0.3));
  EXPECT_EQ(filter("<rfilter type=\"catmullrom\"/>").lobed, &LobedFilter::catmull_rom());
  EXPECT_EQ(filter("<rfilter type=\"lanczos\"><integer name=\"lobes\" value=\"2\"/></rfilter>").radius, 2);
}

TEST_F(ForeignScene, OtherFormatsOfFilmsAreTold) {
  write("scene.xml",
        "<scene version=\"3.0.0\"><sensor type=\"perspective\"><film type=\"hdrfilm\"><string "
        "name=\"pixel_format\" value=\"luminance\"/><string name=\"file_format\" value=\"pfm\"/></film>"
        "</sensor></scene>");
  EXPECT_TRUE(contains(warnings(load_scene(folder_.file("scene.xml"))), "the image is RGB, not 'luminance'"));
  write("scene.xml",
        "<scene version=\"0.6.0\"><sensor type=\"perspective\"><film type=\"tiledhdrfilm\"><string "
        "name=\"pixelFormat\" value=\"luminanceAlpha\"/></film></sensor></scene>");
  EXPECT_TRUE(contains(warnings(load_scene(folder_.file("scene.xml"))), "the image is RGB, not 'luminance_alpha'"));
}

// ---- version 0.x ----

TEST_F(ForeignScene, ThreeNumbersAreAnOldSpectrum) {
  expect_colour(emitted(load_old(lamp("<spectrum name=\"radiance\" value=\"0.5, 2, 3\"/>"))), {0.5f, 2, 3});
  EXPECT_TRUE(contains(errors(lamp("<spectrum name=\"radiance\" value=\"0.5, 2, 3\"/>")), "is not a spectrum sample"));
}

TEST_F(ForeignScene, MixturesAreWeightedSums) {
  const auto mixture = [&](const std::string& weights) {
    const LoadedScene scene = load_old(
        "<shape type=\"rectangle\"><bsdf type=\"mixturebsdf\"><string name=\"weights\" value=\"" + weights +
        "\"/><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"1 0 0\"/></bsdf><bsdf type=\"diffuse\"><rgb "
        "name=\"reflectance\" value=\"0 1 0\"/></bsdf><bsdf type=\"diffuse\"><rgb name=\"reflectance\" value=\"0 0 "
        "1\"/>"
        "</bsdf></bsdf></shape>");
    const Vec3 wi{0, 0.6f, 0.8f};
    return scattered(scene, {0, 0, 1}, wi) * (kPi / 0.8f);
  };
  expect_colour(mixture("0.2, 0.3, 0.5"), {0.2f, 0.3f, 0.5f});
  expect_colour(mixture("0.1 0.2 0.3"), {0.1f, 0.2f, 0.3f});  // the rest is black
  expect_colour(mixture("1, 2, 1"), {0.25f, 0.5f, 0.25f});    // as in 0.6, which conserves energy
  EXPECT_TRUE(contains(errors("<bsdf type=\"mixturebsdf\"><string name=\"weights\" value=\"1 2\"/><bsdf "
                              "type=\"diffuse\"/></bsdf>"),
                       "of 1 nested models: weights '1 2' has 2 values; expected 1"));
}

TEST_F(ForeignScene, OldDistributionsAreReadAsBeckmann) {
  const LoadedScene scene = load_old(
      "<shape type=\"rectangle\"><bsdf type=\"roughconductor\"><string "
      "name=\"distribution\" value=\"as\"/></bsdf></shape>");
  EXPECT_TRUE(contains(warnings(scene), "the distribution 'as' of bsdf 'roughconductor' is read as 'beckmann'"));
}

TEST_F(ForeignScene, MediaMayHaveAbsorptionAndScattering) {
  const LoadedScene scene = load_old(
      "<shape type=\"sphere\"><bsdf type=\"null\"/><medium name=\"interior\" type=\"homogeneous\"><rgb name=\"sigmaS\" "
      "value=\"1 0 3\"/><rgb name=\"sigmaA\" value=\"0.25 0 1\"/><float name=\"scale\" value=\"2\"/></medium></shape>");
  const Medium::Coefficients medium = hit_at_centre(scene).shape->medium_towards({0, 0, 1}, {0, 0, -1})->at({});
  expect_colour(medium.extinction, {2.5f, 0, 8});
  expect_colour(medium.scattering, {2, 0, 6});
  EXPECT_TRUE(
      contains(errors("<medium type=\"homogeneous\"><float name=\"sigma_s\" value=\"1\"/><float name=\"albedo\" "
                      "value=\"1\"/></medium>"),
               "is given together with 'sigma_a' or 'sigma_s'"));
}

// ---- unknown plugins and parameters ----

TEST_F(ForeignScene, WhatNobodyKnowsIsToldOnceAndIgnored) {
  const std::string body =
      "<shape type=\"rectangle\"><bsdf type=\"paint\"><float name=\"gloss\" value=\"2\"/></bsdf>\n"
      "<emitter type=\"area\"><float name=\"warmth\" value=\"1\"/></emitter></shape>\n"
      "<shape type=\"disk\"><bsdf type=\"paint\"/><emitter type=\"area\"><float name=\"warmth\" value=\"2\"/></emitter>"
      "</shape>\n<shape type=\"cloud\"/><emitter type=\"laser\"/><subsurface type=\"dipole\"/><sparkle value=\"3\"/>";
  const std::string refused = errors(body);
  for (const char* part : {"unknown bsdf 'paint'", "unknown parameter 'warmth' of emitter 'area'",
                           "unknown shape 'cloud'", "unknown emitter 'laser'", "unknown element <sparkle>"})
    EXPECT_TRUE(contains(refused, part));
  const LoadedScene scene = load(body, ignoring());
  const std::string told = warnings(scene);
  for (const char* part :
       {"scene.xml:3:25: unknown bsdf 'paint' becomes 'diffuse' (2 times)\n",
        "scene.xml:4:22: unknown parameter 'warmth' of emitter 'area' is ignored (2 times)\n",
        "unknown shape 'cloud' is left out\n", "unknown emitter 'laser' is left out\n",
        "unknown part <subsurface> of <scene> is ignored\n", "unknown element <sparkle> is ignored\n"})
    EXPECT_TRUE(contains(told, part));
  EXPECT_EQ(scene.scene->shapes().size(), 2u);
  EXPECT_EQ(scene.scene->emitters().size(), 2u);
  // Diffuse with reflectance 0.5: f cos = 0.5 cos / pi.
  expect_colour(scattered(scene, {0, 0, 1}, {0, 0.6f, 0.8f}), Spectrum(0.5f * 0.8f / kPi));
}

TEST_F(ForeignScene, UnknownPartsOfTheCameraBecomeTheUsualOnes) {
  write(
      "scene.xml",
      "<scene version=\"3.0.0\"><sensor type=\"codedPerspective\"><float name=\"fov\" value=\"30\"/><film "
      "type=\"coded_hdr_film\"><integer name=\"width\" value=\"20\"/><integer name=\"temporal_bins\" value=\"9\"/>"
      "<rfilter type=\"sharp\"/></film><sampler type=\"correlated\"/></sensor></scene>");
  const LoadedScene scene = load_scene(folder_.file("scene.xml"), ignoring());
  EXPECT_EQ(scene.width, 20);
  EXPECT_EQ(scene.camera->settings().fov_degrees, 30);
  EXPECT_EQ(scene.filter.kind, FilterKind::kGaussian);
  EXPECT_TRUE(contains(warnings(scene), "unknown film 'coded_hdr_film' becomes 'hdrfilm'"));
  write("scene.xml", "<scene version=\"3.0.0\"><sensor type=\"irradiancemeter\"/></scene>");
  EXPECT_TRUE(contains(message_of([&] { load_scene(folder_.file("scene.xml"), ignoring()); }),
                       "sensor 'irradiancemeter' is not supported: it makes no picture"));
}

TEST_F(ForeignScene, FormsOfForksBecomeGrey) {
  const LoadedScene scene = load(
      "<shape type=\"rectangle\"><bsdf type=\"normalmap\"><string name=\"filename\" value=\"n.exr\"/><bsdf "
      "type=\"conductor\"/></bsdf></shape>",
      ignoring());
  EXPECT_TRUE(contains(warnings(scene), "scene.xml:3:25: unknown form of bsdf 'normalmap' becomes 'diffuse'"));
  expect_colour(scattered(scene, {0, 0, 1}, {0, 0.6f, 0.8f}), Spectrum(0.5f * 0.8f / kPi));
}

TEST_F(ForeignScene, WrongValuesStayErrors) {
  EXPECT_TRUE(contains(
      message_of([&] { load("<shape type=\"sphere\"><string name=\"radius\" value=\"x\"/></shape>", ignoring()); }),
      "parameter 'radius' of shape 'sphere' must be a float, not a string"));
}

}  // namespace
}  // namespace covary::foreign_scene_test
