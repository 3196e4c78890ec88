// SPDX-License-Identifier: Apache-2.0
// Scenes of Mitsuba's forks and of its versions 0.x whose picture does not depend on what is particular about them.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <memory>
#include <string>

#include "io/load_scene.h"
#include "support/files.h"

namespace covary::forks_test {
namespace {

using test_support::contains;
using test_support::message_of;

class Forks : public ::testing::Test {
 protected:
  LoadedScene load(const std::string& body, const char* version = "3.0.0", const LoadOptions& options = {}) {
    std::ofstream(folder_.file("scene.xml")) << "<scene version=\"" << version << "\">\n" << body << "\n</scene>\n";
    return load_scene(folder_.file("scene.xml"), options);
  }
  std::string errors(const std::string& body, const char* version = "3.0.0") {
    return message_of([&] { load(body, version); });
  }
  static std::string warnings(const LoadedScene& scene) {
    std::string text;
    for (const std::string& warning : scene.warnings) text += warning + "\n";
    return text;
  }
  /// The light of an environment from direction `d`.
  static float from(const LoadedScene& scene, const Vec3& d) {
    return luminance(scene.scene->environment()->environment(normalize(d)).radiance);
  }

  test_support::TemporaryFolder folder_;
};

const std::string kCamera = "<sensor type=\"perspective\"/>";

TEST_F(Forks, IntegratorsWithTheSamePictureAreRead) {
  struct Read : SceneObject {
    int max_depth, rr_depth;
    std::string type;
  };
  LoadOptions options;
  options.make_integrator = [](Parameters& p) -> std::shared_ptr<SceneObject> {
    auto read = std::make_shared<Read>();
    read->type = p.type();
    read->max_depth = p.get_int("max_depth", -1, -1, 100), read->rr_depth = p.get_int("rr_depth", 5, 1, 100);
    return read;
  };
  for (const auto& [type, version, expected] : {std::tuple("guided_path", "0.6.0", "path"),
                                                {"mlt", "0.5.0", "path"},
                                                {"photonmap", "0.6.0", "path"},
                                                {"prbvolpath", "3.0.0", "path"},
                                                {"direct_projective", "3.0.0", "direct"},
                                                {"sdmm", "0.6.0", "path"},
                                                {"recursive_path", "0.6.0", "path"}}) {
    const bool old = version[0] == '0';
    const LoadedScene scene =
        load(kCamera + fmt::format("<integrator type=\"{}\"><integer name=\"{}\" value=\"7\"/><integer name=\"{}\" "
                                   "value=\"3\"/><string name=\"nee\" value=\"always\"/></integrator>",
                                   type, old ? "maxDepth" : "max_depth", old ? "rrDepth" : "rr_depth"),
             version, options);
    const auto* read = dynamic_cast<const Read*>(scene.integrator.get());
    ASSERT_TRUE(read);
    EXPECT_EQ(read->type, expected);
    EXPECT_EQ(read->max_depth, 7);
    EXPECT_EQ(read->rr_depth, 3);
    EXPECT_TRUE(contains(warnings(scene),
                         fmt::format("scene.xml:2:29: integrator '{}' is read as '{}', whose expected picture is the "
                                     "same; ignored: 'nee'",
                                     type, expected)));
  }
  // Without direct light, the picture is another.
  const std::string direct =
      "<integrator type=\"transient_path\"><boolean name=\"discard_direct_light\" value=\"{}\"/>"
      "</integrator>";
  EXPECT_EQ(load(kCamera + fmt::format(fmt::runtime(direct), "false")).integrator_type, "path");
  EXPECT_EQ(load(kCamera + fmt::format(fmt::runtime(direct), "true")).integrator_type, "transient_path");
}

TEST_F(Forks, WrappersRenderThePictureTheyHold) {
  const LoadedScene scene = load(
      kCamera +
          "<integrator type=\"multichannel\"><integrator type=\"field\"><string name=\"field\" value=\"shNormal\"/>"
          "</integrator><integrator type=\"adaptive\"><float name=\"maxError\" value=\"0.1\"/><integrator "
          "type=\"guided_path\"/></integrator></integrator>",
      "0.6.0");
  EXPECT_EQ(scene.integrator_type, "path");
  for (const char* told :
       {"of integrator 'multichannel' the image of 'adaptive' is rendered; other pictures are left out",
        "of integrator 'adaptive' the image of 'guided_path' is rendered; the numbers of samples"})
    EXPECT_TRUE(contains(warnings(scene), told));
  EXPECT_TRUE(contains(errors(kCamera + "<integrator type=\"multichannel\"><integrator type=\"field\"/></integrator>"),
                       "integrator 'multichannel' holds no integrator: there is no image to render"));
}

TEST_F(Forks, FilmsOfLightInFlightShowAllOfIt) {
  const auto film = [](const char* type, const std::string& more) {
    return fmt::format(
        "<sensor type=\"perspective\"><film type=\"{}\"><integer name=\"width\" value=\"20\"/>{}</film>"
        "</sensor>",
        type, more);
  };
  const LoadedScene transient = load(film(
      "transient_hdr_film",
      "<integer name=\"temporal_bins\" value=\"9\"/><float name=\"start_opl\" value=\"3\"/><rfilter type=\"box\"/>"));
  EXPECT_EQ(transient.width, 20);
  EXPECT_EQ(transient.filter.kind, FilterKind::kBox);
  EXPECT_TRUE(contains(warnings(transient), "'transient_hdr_film' is read as 'hdrfilm': the picture of all light"));
  const std::string boxcox = "<float name=\"lambda\" value=\"0.5\"/><integer name=\"transformation\" value=\"{}\"/>";
  EXPECT_TRUE(contains(warnings(load(film("transient_hdr_film", fmt::format(fmt::runtime(boxcox), 0)))),
                       "parameter 'lambda' of film 'hdrfilm' is ignored: samples are not transformed"));
  EXPECT_TRUE(contains(errors(film("transient_hdr_film", fmt::format(fmt::runtime(boxcox), 1))),
                       "unknown parameter 'transformation' of film 'hdrfilm'"));
  const std::string bounds =
      "<float name=\"minBound\" value=\"1\"/><float name=\"binWidth\" value=\"2\"/>"
      "<string name=\"decomposition\" value=\"{}\"/>";
  const LoadedScene whole = load(film("hdrfilm", fmt::format(fmt::runtime(bounds), "none")), "0.5.0");
  EXPECT_TRUE(contains(warnings(whole), "parameter 'min_bound' of film 'hdrfilm' is ignored: nothing is decomposed"));
  EXPECT_TRUE(contains(errors(film("hdrfilm", fmt::format(fmt::runtime(bounds), "transient")), "0.5.0"),
                       "unknown parameter 'decomposition' of film 'hdrfilm'"));
}

TEST_F(Forks, ParametersOfSamplingAreToldOnce) {
  const std::string wall =
      "<shape type=\"rectangle\"><bsdf type=\"diffuse\"><string name=\"sdmm_filename\" value=\"a\"/>"
      "</bsdf></shape>";
  EXPECT_TRUE(contains(warnings(load(kCamera + wall + wall)),
                       "scene.xml:2:74: parameter 'sdmm_filename' of bsdf 'diffuse' is ignored: it belongs to a "
                       "sampling method and does not change the picture (2 times)\n"));
  const std::string smooth = "<bsdf type=\"dielectric\"><float name=\"alpha\" value=\"0.2\"/></bsdf>";
  EXPECT_TRUE(contains(warnings(load(kCamera + smooth, "0.6.0")),
                       "parameter 'alpha' of bsdf 'dielectric' is ignored: this model is smooth, and Mitsuba 0.x"));
  EXPECT_TRUE(contains(errors(kCamera + smooth), "unknown parameter 'alpha' of bsdf 'dielectric'"));
  EXPECT_TRUE(contains(warnings(load("<sensor type=\"perspective\"><film type=\"hdrfilm\"><float name=\"gamma\" "
                                     "value=\"2.2\"/></film></sensor>",
                                     "0.6.0")),
                       "parameter 'gamma' of film 'hdrfilm' is ignored: the film is linear"));
  const std::string stray = "<integer name=\"maxDepth\" value=\"2\"/>";
  EXPECT_TRUE(contains(warnings(load(kCamera + stray, "0.6.0")), "parameter 'max_depth' of <scene> is ignored"));
  EXPECT_TRUE(contains(errors(kCamera + stray), "unknown parameter 'maxDepth' of <scene>"));
}

/// Mitsuba 0.6, emitters/sunsky/sunmodel.h, toSphere(): (sin a sin t, cos t, -cos a sin t), with the azimuth a from
/// north towards east.
TEST_F(Forks, SkiesOfOldVersionsHaveTheirOwnAxes) {
  const auto sky = [&](const char* type, const std::string& more) {
    return load(kCamera + fmt::format("<emitter type=\"{}\">{}</emitter>", type, more), "0.6.0");
  };
  const LoadedScene plain = sky("sky", "<float name=\"hour\" value=\"9\"/>");
  EXPECT_GT(from(plain, {0, 1, 0}), 0);
  EXPECT_EQ(from(plain, {0, -1, 0}), 0);
  EXPECT_GT(from(plain, {1, 0.3f, 0}), 1.5f * from(plain, {-1, 0.3f, 0}));  // the sun is in the east
  const LoadedScene noon = sky("sky", "<float name=\"hour\" value=\"12\"/><float name=\"scale\" value=\"2\"/>");
  EXPECT_GT(from(noon, {0, 0.3f, 1}), 1.1f * from(noon, {0, 0.3f, -1}));  // in the south
  EXPECT_NEAR(from(noon, {0.2f, 0.5f, 0.3f}),
              2 * from(sky("sky", "<float name=\"hour\" value=\"12\"/>"), {0.2f, 0.5f, 0.3f}), 1e-6f);
  const std::string direction =
      "<vector name=\"sunDirection\" x=\"1\" y=\"1\" z=\"0.5\"/><integer name=\"resolution\" "
      "value=\"64\"/>";
  const LoadedScene sun = sky("sun", direction);
  EXPECT_GT(from(sun, {1, 1, 0.5f}), 0);
  EXPECT_EQ(from(sun, {1, 1, -0.5f}), 0);
  EXPECT_TRUE(contains(warnings(sun), "the sun of emitter 'sun' is that of Mitsuba 3"));
  // A sun of twice the radius: the same light from four times the solid angle.
  const LoadedScene wide = sky("sun", direction + "<float name=\"sunRadiusScale\" value=\"2\"/>");
  EXPECT_NEAR(from(wide, {1, 1, 0.5f}) / from(sun, {1, 1, 0.5f}), 0.25f, 1e-3f);
  // `to_world` turns y up into z up.
  const LoadedScene turned =
      sky("sunsky", "<transform name=\"toWorld\"><rotate x=\"1\" angle=\"90\"/></transform>" + direction);
  EXPECT_GT(from(turned, {0, 0, 1}), 0);
  EXPECT_EQ(from(turned, {0, 0, -1}), 0);
}

}  // namespace
}  // namespace covary::forks_test
