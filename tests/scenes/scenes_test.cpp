// SPDX-License-Identifier: Apache-2.0
// The scenes in scenes/ give the values that the comments in them derive.
//
// Statistical cases: the pixels of one render with independent samples, seed 1, are N independent values with one
// expectation; Student's t-test at alpha = 5e-7. Each case plants an error of 3 % into the expected value, asserts that
// its N detects half of that with power 0.99, and that the test rejects it.
#include <algorithm>
#include <cmath>

#include "passes/light_pass.h"
#include "plans/estimator_plans.h"
#include "plans/integrator_choice.h"
#include "plans/render.h"
#include "render/render_fixture.h"
#include "statistics/p_values.h"

namespace covary {
namespace {

TestScene load_own(const std::string& name, const std::map<std::string, std::string>& defines = {}) {
  LoadOptions options;
  options.defines = defines;
  options.make_integrator = [](Parameters& parameters) -> std::shared_ptr<SceneObject> {
    return scene_integrator(parameters);
  };
  return {load_scene(std::string(COVARY_SOURCE_DIR) + "/scenes/" + name, options)};
}

/// The pixels of columns [x0, x1), one colour channel.
std::vector<double> pixels(const Film& film, int channel, int x0, int x1) {
  std::vector<double> values;
  for (int y = 0; y < film.height(); ++y)
    for (int x = x0; x < x1; ++x) values.push_back(film.mean(x, y)[channel]);
  return values;
}

void expect_mean(const std::vector<double>& values, double expected) {
  constexpr double kPlanted = 0.03;
  statistics::Moments moments;
  for (double value : values) moments.add(value);
  const double detectable = statistics::smallest_detectable(std::sqrt(moments.sample_variance()), moments.n(),
                                                            statistics::test_alpha(), 0.99);
  EXPECT_LT(detectable, 0.5 * kPlanted * expected) << "too few samples to see the planted error";
  const statistics::TestResult result = statistics::t_test(values, expected);
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_FALSE(statistics::t_test(values, expected * (1 + kPlanted)).accepted);
  EXPECT_FALSE(statistics::t_test(values, expected * (1 - kPlanted)).accepted);
}

TEST(OwnScenes, FurnaceGivesTheGeometricSeries) {
  for (const double albedo : {0.2, 0.5, 0.8}) {
    SCOPED_TRACE(albedo);
    const TestScene scene = load_own("furnace.xml", {{"albedo", std::to_string(albedo)}});
    expect_mean(pixels(render(scene, 192, 1), 1, 0, 32), 1 / (1 - albedo));
  }
}

TEST(OwnScenes, FurnaceCutAtADepthGivesThePartialSum) {
  double expected = 1;  // emission seen directly is exact
  for (int depth = 2; depth <= 4; ++depth) {
    SCOPED_TRACE(depth);
    expected += std::pow(0.5, depth - 1);
    const TestScene scene = load_own("furnace.xml", {{"max_depth", std::to_string(depth)}});
    expect_mean(pixels(render(scene, 64, 1), 1, 0, 32), expected);
  }
}

TEST(OwnScenes, VeilsDimByTheirOpacity) {
  const Film film = render(load_own("veil.xml"), 4096, 1);
  for (double value : pixels(film, 1, 0, 8)) EXPECT_EQ(value, 2);  // no veil: nothing is random
  for (int veils = 1; veils <= 3; ++veils) {
    SCOPED_TRACE(veils);
    expect_mean(pixels(film, 1, 8 * veils, 8 * veils + 8), 2 * std::pow(0.6, veils));
  }
}

TEST(OwnScenes, WallShowsItsReflectance) {
  const Film film = render(load_own("wall.xml"), 64, 1);
  for (int channel = 0; channel < 3; ++channel) expect_mean(pixels(film, channel, 0, 32), 0.6 - 0.2 * channel);
}

TEST(OwnScenes, WallHasOneValueInAllPixelsUnderCommonRandomNumbers) {
  const TestScene scene = load_own("wall.xml");
  const auto differing_pixels = [&](Sampling sampling) {
    const Film film = render(scene, 24, 1, sampling, 12);
    int n = 0;
    for (int y = 0; y < film.height(); ++y)
      for (int x = 0; x < film.width(); ++x)
        n += !std::equal(film.groups_of(x, y), film.groups_of(x, y) + 12 * 3, film.groups_of(0, 0));
    return n;
  };
  EXPECT_EQ(differing_pixels(Sampling::kCrn), 0);
  EXPECT_EQ(differing_pixels(Sampling::kIndependent), 32 * 24 - 1);  // planted bug: the wall is not constant by itself
}

/// Image means of renders with seeds 0 … 63, light films included.
std::vector<double> caustic_means(const std::string& integrator, LightTracing mode) {
  LoadOptions options;
  options.width = 16, options.height = 12;
  options.defines = {{"lamp", "0.8"}, {"integrator", integrator}};
  if (integrator == "bdpt")
    options.integrator_properties = {{"light_tracing", mode == LightTracing::kOn ? "on" : "off", {}}};
  options.make_integrator = integrator_maker({});
  const LoadedScene scene = load_scene(std::string(COVARY_SOURCE_DIR) + "/scenes/caustic.xml", options);
  std::vector<double> means;
  for (uint64_t seed = 0; seed < 64; ++seed) {
    RenderRequest request;
    request.spp = 96, request.seed = seed;
    double sum = 0;
    for (const float value : render(scene, plain_plan(Sampling::kIndependent), request).picture().data) sum += value;
    means.push_back(sum / (16 * 12 * 3));
  }
  return means;
}

TEST(OwnScenes, CausticsOfLightPathsAreThoseOfPathTracing) {
  const std::vector<double> path = caustic_means("path", LightTracing::kOff);
  for (const LightTracing mode : {LightTracing::kOn, LightTracing::kOff}) {
    std::vector<double> ratios = caustic_means("bdpt", mode);
    for (size_t i = 0; i < ratios.size(); ++i) ratios[i] /= path[i];
    expect_mean(ratios, 1);
  }
}

// A grid of smoke, and coloured resin in a smooth boundary: means of channels of 8 renders, against 8 of 512 samples
// by Mitsuba 3.9.1 (volpathmis). Z-test at alpha = 5e-7 with the variances of both.
TEST(OwnScenes, SmokeIsThatOfMitsuba) {
  const double expected[] = {0.18145503, 0.21587822, 0.24233016}, error[] = {0.00043369, 0.00021587, 0.00015018};
  const TestScene scene = load_own("smoke.xml", {{"width", "16"}, {"height", "16"}});
  statistics::Moments moments[3];
  for (int seed = 0; seed < 8; ++seed) {
    const Film film = render(scene, 192, seed);
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (const double value : pixels(film, c, 0, 16)) sum += value;
      moments[c].add(sum / 256);
    }
  }
  for (int c = 0; c < 3; ++c) {
    SCOPED_TRACE(c);
    const double variance = moments[c].sample_variance() / 8 + error[c] * error[c];
    const statistics::TestResult result = statistics::z_test(moments[c].mean(), variance, expected[c]);
    EXPECT_TRUE(result.accepted) << result.message;
    EXPECT_FALSE(statistics::z_test(moments[c].mean(), variance, 1.04 * expected[c]).accepted);
  }
}

// Fog of no density is not there.
TEST(OwnScenes, FogOfNoDensityShowsTheSky) {
  const TestScene scene = load_own("fog.xml", {{"width", "24"}, {"height", "16"}, {"density", "0"}});
  const Film film = render(scene, 4, 1);
  EXPECT_EQ(film.mean(1, 0), Spectrum(0.02f, 0.03f, 0.05f));
}

TEST(OwnScenes, AllLoadWithoutWarnings) {
  for (const auto& entry : std::filesystem::directory_iterator(std::string(COVARY_SOURCE_DIR) + "/scenes")) {
    if (entry.path().extension() != ".xml") continue;
    SCOPED_TRACE(entry.path());
    EXPECT_EQ(load_own(entry.path().filename().string()).loaded.warnings, std::vector<std::string>{});
  }
}

}  // namespace
}  // namespace covary
