// SPDX-License-Identifier: Apache-2.0
// Images of bidirectional path tracing against those of `path`, and planted bugs that must be detected.
//
// Statistical cases: R = 32 renders of each integrator with seeds 0 … 31, Student's t-test of the differences of image
// means at alpha = 5e-7. Each case asserts that it detects, with power 0.99, the relative error that it claims.
#include <algorithm>
#include <cmath>

#include "bdpt_scenes.h"
#include "film/splat_layer.h"
#include "integrators/bidirectional_tracer.h"
#include "integrators/path_tracer.h"
#include "statistics/p_values.h"

namespace covary {
namespace {

constexpr int kRenders = 32, kSize = 8;

enum class Bug {
  kNone,
  kNoAdjoint,          ///< light subpaths ignore the correction for shading normals
  kRadianceFromLight,  ///< light subpaths scale by squared ratios of indices, as for radiance
  kLightPmfForgotten,  ///< emission is not divided by the light's probability
  kSplatsNotDivided,   ///< splats are not divided by the number of light paths
};

struct PartsWithBug : BidirectionalParts {
  Bug bug = Bug::kNone;
  TransportMode light_mode() const {
    return bug == Bug::kRadianceFromLight ? TransportMode::kRadiance : TransportMode::kImportance;
  }
  float adjoint_factor(const Vec3& wo, const Vec3& wi, const Vec3& ng) const {
    return bug == Bug::kNoAdjoint ? 1 : BidirectionalParts::adjoint_factor(wo, wi, ng);
  }
  float emission_pmf(const PowerLights& lights, const Emitter& emitter) const {
    return bug == Bug::kLightPmfForgotten ? 1 : BidirectionalParts::emission_pmf(lights, emitter);
  }
  float splat_factor() const { return bug == Bug::kSplatsNotDivided ? 4 : 1; }
};

/// Settings of the integrator.
struct Mode {
  bool light_tracing = false;
  Bug bug = Bug::kNone;
  double light_paths = 1;
};

TestScene load_bdpt(const std::string& xml, const Mode& mode) {
  return load_text(xml, 0, [&](const PathLengthSettings& lengths) {
    PartsWithBug parts;
    parts.bug = mode.bug;
    BidirectionalSettings settings{lengths, {mode.light_tracing ? LightTracing::kOn : LightTracing::kOff}};
    settings.light_tracing.paths_per_sample = mode.light_paths;
    auto tracer = std::make_shared<BidirectionalTracer<PartsWithBug>>(settings, parts);
    tracer->fix_light_tracing(kSize * kSize, false);
    return tracer;
  });
}

TestScene load_path(const std::string& xml) {
  return load_text(xml, 0, [](const PathLengthSettings& lengths) {
    return std::make_shared<PathTracer<PathParts>>("path", lengths);
  });
}

/// Mean of the image of the light pass; 0 without light tracing.
double light_image_mean(const TestScene& scene, uint32_t spp, uint64_t seed, double light_paths) {
  const LightTracingIntegrator* tracer = light_tracer(scene.integrator());
  if (!tracer) return 0;
  Film film = new_film(scene);
  PassSettings settings;
  settings.seed = seed, settings.pass = kLightPass, settings.filter = scene.loaded.filter;
  settings.spp = static_cast<uint32_t>(spp * light_paths * kSize * kSize / kBundlePaths);
  EXPECT_TRUE(render_light_pass(scene.scene(), *tracer, settings, film).complete);
  return image_mean(film);
}

std::vector<double> image_means(const TestScene& scene, uint32_t spp, double light_paths, uint64_t first_seed) {
  std::vector<double> means;
  for (uint64_t seed = first_seed; seed < first_seed + kRenders; ++seed)
    means.push_back(image_mean(render(scene, spp, seed)) + light_image_mean(scene, spp, seed, light_paths));
  return means;
}

struct Comparison {
  statistics::TestResult result;
  double detectable = 0;  ///< relative
};

/// Compares image means with `expected`, those of `path`.
Comparison compare(const std::string& xml, const Mode& mode, uint32_t spp, const std::vector<double>& expected) {
  const std::vector<double> means = image_means(load_bdpt(xml, mode), spp, mode.light_paths, 0);
  std::vector<double> differences;
  statistics::Moments moments, whole;
  for (int i = 0; i < kRenders; ++i) {
    differences.push_back(means[i] - expected[i]);
    moments.add(differences.back()), whole.add(expected[i]);
  }
  const double detectable =
      statistics::smallest_detectable(std::sqrt(moments.sample_variance()), kRenders, statistics::test_alpha(), 0.99);
  return {statistics::t_test(differences, 0), 1.3 * detectable / whole.mean()};
}

/// Compares without and with light tracing. `bugs` must be detected with it, `of_connections` also without.
void expect_images_of_path(const std::string& xml, uint32_t spp, double detects, const std::vector<Bug>& bugs = {},
                           const std::vector<Bug>& of_connections = {}) {
  const std::vector<double> expected = image_means(load_path(xml), spp, 0, 100);
  for (const bool light_tracing : {false, true}) {
    SCOPED_TRACE(light_tracing ? "with light tracing" : "without light tracing");
    const Comparison right = compare(xml, {light_tracing}, spp, expected);
    EXPECT_TRUE(right.result.accepted) << right.result.message;
    EXPECT_LT(right.detectable, detects) << "too few samples to see the error";
    for (const Bug bug : light_tracing ? bugs : of_connections)
      EXPECT_FALSE(compare(xml, {light_tracing, bug}, spp, expected).result.accepted)
          << "bug " << static_cast<int>(bug);
  }
}

const char* const kDown = "<lookat origin='0, 3, -1' target='0, -1.5, 4' up='0, 1, 0'/>";
std::string sensor() { return std::string("<transform name='to_world'>") + kDown + "</transform>"; }

// A floor with tilted shading normals sees the light directly and by way of a wall.
TEST(BdptImages, LeaningNormals) {
  expect_images_of_path(
      bdpt_scene(leaning_floor(diffuse(0.8)) +
                     rectangle("<scale value='4'/><rotate x='1' angle='180'/><translate y='1' z='8'/>", diffuse(0.8)) +
                     rectangle("<rotate x='1' angle='120'/><translate y='2' z='4'/>", area_light(5)),
                 kSize, 4, "", sensor()),
      64, 0.06, {Bug::kNoAdjoint, Bug::kSplatsNotDivided});
}

// A small spot on the floor lights the wall that the camera sees: light subpaths that connect to the wall find it.
TEST(BdptImages, SpotOnLeaningNormals) {
  const char* const kNarrow =
      "<emitter type='spot'><transform name='to_world'><lookat origin='0, 1, 2' target='3, -2, 7' up='0, 1, 0'/>"
      "</transform><float name='cutoff_angle' value='12'/><rgb name='intensity' value='50'/></emitter>";
  expect_images_of_path(
      bdpt_scene(leaning_floor(diffuse(0.8)) +
                     rectangle("<scale value='4'/><rotate x='1' angle='180'/><translate y='2' z='8'/>", diffuse(0.8)) +
                     kNarrow,
                 kSize, 3, "",
                 "<transform name='to_world'><lookat origin='0, 2, 0' target='0, 2, 8' up='0, 1, 0'/></transform>"),
      128, 0.2, {Bug::kNoAdjoint}, {Bug::kNoAdjoint});
}

// A light behind glass, reached only through delta events; and rough glass, on which subpaths connect.
TEST(BdptImages, Glass) {
  const std::string floor =
      rectangle("<scale value='4'/><rotate x='1' angle='-90'/><translate y='-1' z='4'/>", diffuse(0.7));
  expect_images_of_path(
      bdpt_scene(floor + sphere("0", "0.5", "4", "0.9", kGlass) + sphere("0", "0.5", "4", "0.5", area_light(5)), kSize,
                 6, "", sensor()),
      64, 0.1, {Bug::kRadianceFromLight});
  expect_images_of_path(
      bdpt_scene(floor + sphere("0", "0.5", "4", "0.9", kRoughGlass) + sphere("0", "0.5", "4", "0.5", area_light(5)),
                 kSize, 6, "", sensor()),
      64, 0.1, {Bug::kRadianceFromLight});
}

// Lights of different power, so that emission chooses them with different probabilities.
TEST(BdptImages, ManyLights) {
  const std::string room =
      leaning_floor(diffuse(0.6)) +
      rectangle("<scale value='4'/><rotate x='1' angle='180'/><translate y='1' z='8'/>", diffuse(0.8));
  expect_images_of_path(bdpt_scene(room + area_lights() + kPoint + kSpot, kSize, 4, "", sensor()), 64, 0.05,
                        {Bug::kLightPmfForgotten, Bug::kSplatsNotDivided});
  expect_images_of_path(bdpt_scene(room + kConstant + kDirectional, kSize, 4, "", sensor()), 64, 0.05);
}

TEST(BdptImages, AllMaterials) {
  expect_images_of_path(bdpt_scene(materials() + area_lights() + kConstant + kPoint, kSize, -1,
                                   "<integer name='rr_depth' value='3'/>", sensor()),
                        128, 0.06);
}

TEST(BdptImages, ThinLensAndHiddenLights) {
  expect_images_of_path(
      bdpt_scene(leaning_floor(diffuse(0.6)) + sphere("0", "-1", "4", "0.8", kHalfMirror) + area_lights() + kPoint,
                 kSize, 4, "<boolean name='hide_emitters' value='true'/>", sensor(), kThinLens),
      64, 0.07);
}

// Lights that rays pass through: a sphere in front of the camera, and a rectangle.
TEST(BdptImages, LightsThatRaysPassThrough) {
  std::string light = area_light(5);
  light.replace(light.find("</emitter>"), 0, "<boolean name='hidden' value='true'/>");
  expect_images_of_path(
      bdpt_scene(leaning_floor(diffuse(0.8)) +
                     rectangle("<scale value='4'/><rotate x='1' angle='180'/><translate y='1' z='8'/>", diffuse(0.8)) +
                     rectangle("<rotate x='1' angle='120'/><translate y='2' z='4'/>", light) +
                     sphere("0", "0.5", "2", "0.7", light),
                 kSize, 4, "", sensor()),
      64, 0.06, {Bug::kLightPmfForgotten, Bug::kSplatsNotDivided});
}

/// A floor, a ceiling and a light within 80 units of the camera, with all lengths multiplied by `scale`.
std::string scaled_scene(const std::string& scale) {
  const auto placed = [&](const std::string& transform, const std::string& content) {
    return rectangle(transform + "<scale value='" + scale + "'/>", content);
  };
  const std::string far = "<float name='near_clip' value='" + scale + "'/><float name='far_clip' value='1e9'/>";
  return bdpt_scene(
      placed("<scale value='40'/><rotate x='1' angle='-90'/><translate y='-10' z='40'/>", diffuse(0.7)) +
          placed("<scale value='40'/><rotate x='1' angle='180'/><translate y='1' z='80'/>", diffuse(0.8)) +
          placed("<scale value='10'/><rotate x='1' angle='90'/><translate y='30' z='40'/>", area_light(5)),
      kSize, 4, "", far);
}

TEST(BdptImages, ScaledScenes) {
  for (const char* scale : {"0.001", "1", "1000", "1000000"}) {
    SCOPED_TRACE(scale);
    expect_images_of_path(scaled_scene(scale), 32, 0.05);
  }
}

// Scaling by powers of two does not round: for scenes below one unit, where no absolute length matters, images have the
// same bits.
TEST(BdptImages, SmallScenesDoNotKnowTheUnitOfLength) {
  for (const char* integrator : {"path", "bdpt"}) {
    SCOPED_TRACE(integrator);
    const auto image = [&](const char* scale) {
      std::string xml = scaled_scene(scale);
      xml.replace(xml.find("type='bdpt'"), 11, "type='" + std::string(integrator) + "'");
      const TestScene scene = load_text(xml);
      return render(scene, 16, 3).mean_image();
    };
    const Image large = image("0.0078125"), small = image("0.0000152587890625");  // 2^-7, 2^-16
    ASSERT_GT(*std::max_element(large.data.begin(), large.data.end()), 0);
    EXPECT_EQ(large.data, small.data);
  }
}

// Any number of light paths per sample gives the same mean.
TEST(BdptImages, FewOrManyLightPaths) {
  const std::string xml = bdpt_scene(leaning_floor(diffuse(0.6)) + area_lights(), kSize, 3, "", sensor());
  const std::vector<double> expected = image_means(load_path(xml), 64, 0, 100);
  for (const double light_paths : {0.25, 4.0}) {
    const Comparison c = compare(xml, {true, Bug::kNone, light_paths}, 64, expected);
    EXPECT_TRUE(c.result.accepted) << light_paths << ": " << c.result.message;
    EXPECT_LT(c.detectable, 0.05);
  }
}

}  // namespace
}  // namespace covary
