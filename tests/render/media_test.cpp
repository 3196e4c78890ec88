// SPDX-License-Identifier: Apache-2.0
// Participating media in `path`, in scenes with closed-form solutions.
//
// Statistical cases: the pixels of a render with independent samples are N independent values with the same expectation
// (the field of view is so small that all see the same); Student's t-test at alpha = 5e-7. Each case plants a relative
// error of the expected value, 3 % by default, and asserts that its N detects half of that with power 0.99 and that the
// test rejects it.
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>

#include "integrators/aov.h"
#include "render_fixture.h"
#include "statistics/p_values.h"
#include "support/volume_text.h"

namespace covary {
namespace {

using test_support::contains;

const std::string kNarrow = "<float name='fov' value='0.01'/>";
const std::string kSky = "<emitter type='constant'/>";
const std::string kBoundary = "<bsdf type='null'/>";

std::string medium(const std::string& extinction, const std::string& albedo, const std::string& phase = "",
                   const std::string& name = "interior") {
  return "<medium type='homogeneous' name='" + name + "'><float name='scale' value='2'/><rgb name='sigma_t' value='" +
         extinction + "'/><rgb name='albedo' value='" + albedo + "'/>" + phase + "</medium>";
}

/// A medium whose extinction is twice the values of cells along z in [4, 6].
std::string grid_medium(const std::vector<float>& cells, const std::string& albedo, int channels = 1,
                        const std::string& phase = "") {
  const std::string file = test_support::test_file("grid.vol");
  const int n = static_cast<int>(cells.size()) / channels;
  std::ofstream(file, std::ios::binary) << test_support::volume_text(1, 1, n, channels, cells);
  return "<medium type='heterogeneous' name='interior'><volume type='gridvolume' name='sigma_t'><string "
         "name='filename' "
         "value='" +
         file +
         "'/><string name='filter_type' value='nearest'/><boolean name='use_grid_bbox' value='true'/><transform "
         "name='to_world'><translate z='5'/></transform></volume><float name='scale' value='2'/><rgb name='albedo' "
         "value='" +
         albedo + "'/>" + phase + "</medium>";
}

/// The box [-1, 1]² x [4, 6] filled with a medium.
std::string box(const std::string& inside, const std::string& boundary = kBoundary) {
  return "<shape type='cube'><transform name='to_world'><translate z='5'/></transform>" + boundary + inside +
         "</shape>";
}
std::string wall(const std::string& inside) {
  return "<shape type='rectangle'><transform name='to_world'><scale value='50'/><rotate y='1' angle='180'/><translate "
         "z='8'/></transform>" +
         inside + "</shape>";
}
const std::string kLitWall = wall("<emitter type='area'><rgb name='radiance' value='1, 2, 3'/></emitter>");

TestScene load(const std::string& body, int max_depth = -1, int min_depth = 0) {
  return load_text(scene_text(body, 32, 32, max_depth, kNarrow), min_depth);
}

void expect_mean(const Film& film, int channel, double expected, double planted = 0.03) {
  std::vector<double> values;
  statistics::Moments moments;
  for (int y = 0; y < film.height(); ++y)
    for (int x = 0; x < film.width(); ++x) values.push_back(film.mean(x, y)[channel]), moments.add(values.back());
  const double detectable = statistics::smallest_detectable(std::sqrt(moments.sample_variance()), moments.n(),
                                                            statistics::test_alpha(), 0.99);
  EXPECT_LT(detectable, 0.5 * planted * expected) << "too few samples to see the planted error";
  const statistics::TestResult result = statistics::t_test(values, expected);
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_FALSE(statistics::t_test(values, expected * (1 + planted)).accepted);
  EXPECT_FALSE(statistics::t_test(values, expected * (1 - planted)).accepted);
}

// Without scattering, the medium attenuates the wall behind it exponentially; distances are sampled by one channel and
// used for all.
TEST(Media, AbsorptionIsExponential) {
  const Film film = render(load(box(medium("0.05, 0.2, 0.5", "0")) + kLitWall), 1024, 1);
  for (int c = 0; c < 3; ++c) {
    SCOPED_TRACE(c);
    expect_mean(film, c, (c + 1) * std::exp(-4 * (c == 0 ? 0.05 : c == 1 ? 0.2 : 0.5)), 0.05);
  }
}

TEST(Media, AGridAbsorbsItsIntegral) {  // cells of size 2/3 with extinctions of 2 · (0.1, 0.7, 0.3)
  const Film film = render(load(box(grid_medium({0.1f, 0.7f, 0.3f}, "0")) + kLitWall), 1024, 2);
  expect_mean(film, 1, 2 * std::exp(-2 * 1.1 * 2 / 3));
}

TEST(Media, AColouredGridAbsorbsItsIntegrals) {
  const Film film = render(load(box(grid_medium({0.1f, 0.6f, 0, 0.2f, 0.1f, 0.5f}, "0", 3)) + kLitWall), 1024, 3);
  for (int c = 0; c < 3; ++c) {
    SCOPED_TRACE(c);
    expect_mean(film, c, (c + 1) * std::exp(-2 * (c == 0 ? 0.3 : c == 1 ? 0.7 : 0.5)), 0.06);
  }
}

// A light at the camera illuminates a diffuse wall through the box: light samples cross two boundaries and the medium.
TEST(Media, LightSamplesSeeThroughBoundaries) {
  const std::string lamp =
      "<emitter type='point'><point name='position' x='0' y='0' z='3.5'/><rgb name='intensity' "
      "value='10'/></emitter>";
  const std::string body = wall("<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf>") + lamp;
  const double unhidden = 10 / (4.5 * 4.5) * 0.5 / 3.14159265358979;
  expect_mean(render(load(box(medium("0.1", "0")) + body, 2), 256, 4), 0, unhidden * std::exp(-2 * 0.4));
  expect_mean(render(load(box(grid_medium({0.05f, 0.15f}, "0")) + body, 2), 256, 5), 0, unhidden * std::exp(-2 * 0.4));
}

// Without scattering, a glowing medium adds radiance (1 - exp(-depth)).
TEST(Media, WhatAbsorbsMayGlow) {
  const std::string glow = "<rgb name='radiance' value='3, 2, 1'/>";
  const Film film = render(load(box(medium("0.05, 0.2, 0.5", "0", glow)) + kLitWall), 1024, 11);
  const Film grid = render(load(box(grid_medium({0.1f, 0.7f, 0.3f}, "0", 1, glow)) + kLitWall), 1024, 12);
  for (int c = 0; c < 3; ++c) {
    SCOPED_TRACE(c);
    const double through = std::exp(-4 * (c == 0 ? 0.05 : c == 1 ? 0.2 : 0.5));
    expect_mean(film, c, (c + 1) * through + (3 - c) * (1 - through), 0.05);
    const double beyond = std::exp(-2 * 1.1 * 2 / 3);
    expect_mean(grid, c, (c + 1) * beyond + (3 - c) * (1 - beyond), 0.06);
  }
}

// Radiance that varies: layers along the ray, each of depth d_i, glow by their own and shine through those in front.
TEST(Media, EachPartOfAGridGlowsByItsOwnRadiance) {
  const std::string file = test_support::test_file("glow.vol");
  std::ofstream(file, std::ios::binary) << test_support::volume_text(1, 1, 2, 1, {3, 1});
  const std::string glow =
      "<volume type='gridvolume' name='radiance'><string name='filename' value='" + file +
      "'/><string name='filter_type' value='nearest'/><boolean name='use_grid_bbox' value='true'/><transform "
      "name='to_world'><translate z='5'/></transform></volume>";
  const Film film = render(load(box(grid_medium({0.3f, 0.3f}, "0", 1, glow))), 1024, 13);
  const double one = std::exp(-0.6);  // the camera looks along z: the first cell is in front
  expect_mean(film, 1, 3 * (1 - one) + one * (1 - one));
}

// Kirchhoff: what glows as its surroundings do is invisible, however it scatters.
TEST(Media, WhatGlowsLikeItsSurroundingsIsInvisible) {
  const std::string glow = "<rgb name='radiance' value='1'/>";
  for (const std::string& inside : {medium("0.1, 0.4, 1", "0.5", glow), grid_medium({0.1f, 0.9f, 0.4f}, "0.7", 1, glow),
                                    grid_medium({0.1f, 0.6f, 0, 0.2f, 0.1f, 0.9f}, "0.3", 3, glow)}) {
    const Film film = render(load(box(inside) + kSky), 256, 14);
    for (int c = 0; c < 3; ++c) expect_mean(film, c, 1, 0.05);
  }
}

// In a uniform environment of radiance 1, a medium with albedo 1 is invisible.
TEST(Media, WhatScattersEverythingIsInvisible) {
  const std::string forwards = "<phase type='hg'><float name='g' value='0.7'/></phase>";
  for (const std::string& inside :
       {medium("0.6", "1"), medium("0.1, 0.4, 1", "1"), medium("0.6", "1", forwards),
        grid_medium({0.1f, 0.9f, 0.4f}, "1"), grid_medium({0.1f, 0.6f, 0, 0.2f, 0.1f, 0.9f}, "1", 3, forwards)}) {
    const Film film = render(load(box(inside) + kSky), 256, 6);
    for (int c = 0; c < 3; ++c) expect_mean(film, c, 1, 0.05);
  }
}

const std::string kMask =
    "<bsdf type='mask'><float name='opacity' value='0.3'/><bsdf type='diffuse'><rgb name='reflectance' "
    "value='0'/></bsdf></bsdf>";
const std::string kPane = "<bsdf type='thindielectric'><float name='int_ior' value='1.5'/></bsdf>";

// The light at the camera again, which direction samples never find: its light crosses two surfaces each way.
TEST(Media, LightSamplesSeeThroughMasksAndPanes) {
  const std::string lamp =
      "<emitter type='point'><point name='position' x='0' y='0' z='3.5'/><rgb name='intensity' "
      "value='10'/></emitter>";
  const std::string body = wall("<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf>") + lamp;
  const double unhidden = 10 / (4.5 * 4.5) * 0.5 / 3.14159265358979 * std::exp(-2 * 0.4);
  expect_mean(render(load(box(medium("0.1", "0"), kMask) + body, 2), 1024, 4), 0, unhidden * std::pow(0.7, 4));
  const double pane = 1 - 2 * 0.04 / (1 + 0.04);
  expect_mean(render(load(box(medium("0.1", "0"), kPane) + body, 2), 512, 5), 0, unhidden * std::pow(pane, 4));
}

// Panes reflect what they do not transmit, so no light is lost, and the weights of both techniques add up to 1.
TEST(Media, WhatScattersEverythingBehindPanesIsInvisible) {
  for (const std::string& inside : {medium("0.6", "1"), medium("0.1, 0.4, 1", "1")}) {
    const Film film = render(load(box(inside, kPane) + kSky), 256, 6);
    for (int c = 0; c < 3; ++c) expect_mean(film, c, 1, 0.05);
  }
}

TEST(Media, FiltersOfPolarisationDimAtBoundaries) {
  const Film film = render(load(box(medium("0", "0"), "<bsdf type='polarizer'/>") + kLitWall), 1, 1);
  EXPECT_EQ(film.mean(3, 5), Spectrum(1, 2, 3) * 0.25f);
}

TEST(Media, WithoutLightSamplesToo) {
  const std::string inside =
      "<medium type='homogeneous' name='interior'><float name='albedo' value='1'/><boolean "
      "name='sample_emitters' value='false'/></medium>";
  expect_mean(render(load(box(inside) + kSky), 128, 6), 1, 1);
}

// The camera is in unbounded, purely absorbing fog, at the centre of a spherical light.
TEST(Media, TheCameraMayStandInOne) {
  const std::string lamp =
      "<shape type='sphere'><float name='radius' value='4'/><boolean name='flip_normals' "
      "value='true'/><emitter type='area'><rgb name='radiance' value='1'/></emitter></shape>";
  const std::string fog =
      "<medium type='homogeneous'><float name='sigma_t' value='0.25'/><float name='albedo' "
      "value='0'/></medium>";
  const TestScene scene = load_text(scene_text(lamp, 32, 32, -1, kNarrow + fog));
  expect_mean(render(scene, 512, 7), 1, std::exp(-1));
}

// A grid with one value is a homogeneous medium: means with the same random numbers differ only by noise.
TEST(Media, AGridOfOneValueIsHomogeneous) {
  const std::string lamp = "<emitter type='point'><point name='position' x='2' y='1' z='4'/></emitter>";
  const TestScene even = load(box(medium("0.8", "0.9")) + kSky + lamp);
  const TestScene grid = load(box(grid_medium(std::vector<float>(5, 0.8f), "0.9")) + kSky + lamp);
  std::vector<double> differences;
  for (int seed = 0; seed < 32; ++seed)
    differences.push_back(image_mean(render(even, 16, seed)) - image_mean(render(grid, 16, seed)));
  const statistics::TestResult result = statistics::t_test(differences, 0);
  EXPECT_TRUE(result.accepted) << result.message;
  EXPECT_FALSE(statistics::t_test(differences, 0.01).accepted);
}

TEST(Media, SingleLengthsAddUpToTheWhole) {
  const std::string body =
      box(medium("0.5", "0.9")) + kSky + wall("<bsdf type='diffuse'><rgb name='reflectance' value='0.5'/></bsdf>");
  constexpr int kMax = 5;
  const Film whole = render(load(body, kMax), 4, 3);
  std::vector<double> sums(32 * 32);
  for (int depth = 1; depth <= kMax; ++depth) {
    const Film part = render(load(body, depth, depth), 4, 3);
    for (int i = 0; i < 1024; ++i) sums[i] += part.mean(i % 32, i / 32).g;
  }
  for (int i = 0; i < 1024; ++i) EXPECT_NEAR(sums[i], whole.mean(i % 32, i / 32).g, 1e-4);
}

// A boundary before the light is not a vertex: the light's emission belongs to paths of one edge.
TEST(Media, BoundariesAreNoEdges) {
  const Film film = render(load(box(medium("0", "0")) + kLitWall, 1), 1, 1);
  EXPECT_EQ(film.mean(3, 5), Spectrum(1, 2, 3));
}

TEST(Media, HiddenLightsDoNotHideWhatIsBehind) {
  const std::string pane =
      "<shape type='rectangle'><transform name='to_world'><translate z='2'/></transform><emitter "
      "type='area'/></shape>";
  const std::string text = scene_text(pane + box(medium("0", "0")) + kSky, 8, 8, -1, kNarrow,
                                      "<boolean name='hide_emitters' value='true'/>");
  EXPECT_EQ(render(load_text(text), 1, 1).mean(3, 5), Spectrum(0));
}

TEST(Media, BitsDoNotDependOnThreads) {
  const TestScene scene = load(box(grid_medium({0.1f, 0.9f, 0.4f}, "0.8")) + kSky);
  for (const Sampler sampler : {Sampler::kIndependent, Sampler::kSobol})
    for (const Sampling sampling : {Sampling::kIndependent, Sampling::kCrn}) {
      std::vector<Film> films;
      for (const size_t threads : {1, 5}) {
        const tbb::global_control control(tbb::global_control::max_allowed_parallelism, threads);
        films.push_back(render(scene, 8, 7, sampling, 4, sampler));
      }
      EXPECT_TRUE(same_bits(films[0], films[1]));
    }
}

// With common random numbers, pixels that see the same have the same samples, however often their paths collide.
TEST(Media, CommonRandomNumbersGiveEqualPixels) {
  const TestScene scene = load(box(grid_medium({0.3f, 0.9f, 0.4f}, "0.8, 0.9, 0.7")) + kSky);
  const auto spread = [&](Sampling sampling) {
    const Film film = render(scene, 4, 7, sampling);
    statistics::Moments moments;
    for (int i = 0; i < 1024; ++i) moments.add(film.mean(i % 32, i / 32).g);
    return std::sqrt(moments.sample_variance());
  };
  EXPECT_GT(spread(Sampling::kIndependent), 0.02);
  EXPECT_LT(spread(Sampling::kCrn), 1e-3);
}

TEST(Media, AuxiliaryImagesShowThemOrWhatIsBehind) {
  const auto images_of = [](const std::string& extinction) {
    const TestScene scene = load(box(medium(extinction, "0.2, 0.5, 0.8")) +
                                 wall("<bsdf type='diffuse'><rgb name='reflectance' value='0.9'/></bsdf>"));
    Film film = new_film(scene);
    PassSettings settings;
    settings.filter = scene.loaded.filter;
    render_aovs(scene.scene(), settings, 16, film);
    return film.aovs;
  };
  for (const char* albedo : {"Albedo", "DenoisingAlbedo"}) {
    EXPECT_FLOAT_EQ(images_of("50").at(albedo).pixel(3, 5)[0], 0.2f);
    EXPECT_FLOAT_EQ(images_of("0").at(albedo).pixel(3, 5)[0], 0.9f);
  }
  EXPECT_EQ(images_of("50").at("N").pixel(3, 5)[2], 0);
  EXPECT_FLOAT_EQ(images_of("0").at("N").pixel(3, 5)[2], -1);
  EXPECT_NEAR(images_of("50").at("P").pixel(3, 5)[2], 4, 0.05);
}

TEST(Media, OtherIntegratorsRefuseThem) {
  const TestScene scene = load(box(medium("1", "0.5")));
  for (const IntegratorPlugin& plugin : integrator_plugins()) {
    Settings settings;
    const auto integrator = make_integrator(plugin, settings);
    const std::string message = test_support::message_of([&] { require_sees_media(*integrator, scene.scene()); });
    if (integrator->sees_media())
      EXPECT_EQ(message, "no error") << plugin.name;
    else
      EXPECT_TRUE(contains(message, ": medium 'homogeneous': the integrator '" + std::string(plugin.name) +
                                        "' does not support participating media; 'path' does"))
          << message;
  }
}

}  // namespace
}  // namespace covary
