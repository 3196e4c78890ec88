// SPDX-License-Identifier: Apache-2.0
// Scenes with closed-form solutions, rendered by `path` and by path tracers with a planted bug (planted_bugs.h).
//
// Statistical cases: R = 32 renders with seeds 0 … 31, Student's t-test of the image mean at alpha = 5e-7 (|t_31| >
// 6.3). With the standard error s of the mean of the 32 renders, the test rejects an error of 6.3 s + 2.5 s = 8.8 s
// with power 0.99; each case asserts that this is below the relative error that it claims to detect. Every bug that a
// case lists must be rejected.
#include <algorithm>
#include <cmath>

#include "planted_bugs.h"
#include "render_fixture.h"
#include "statistics/p_values.h"

namespace covary {
namespace {

constexpr int kRenders = 32;

MakeIntegrator with(Bug bug) {
  return [bug](const PathLengthSettings& lengths) { return make_path_with(bug, lengths); };
}

std::vector<double> image_means(const TestScene& scene, uint32_t spp) {
  std::vector<double> means;
  for (int seed = 0; seed < kRenders; ++seed) means.push_back(image_mean(render(scene, spp, seed)));
  return means;
}

/// Expects the mean of the scene's images to be `expected`, and that relative errors of `detects` and the bugs are
/// detected.
void expect_image_mean(const std::string& xml, uint32_t spp, double expected, double detects,
                       std::initializer_list<Bug> bugs) {
  const std::vector<double> means = image_means(load_text(xml), spp);
  statistics::Moments moments;
  for (const double mean : means) moments.add(mean);
  const double detectable =
      statistics::smallest_detectable(std::sqrt(moments.sample_variance()), kRenders, statistics::test_alpha(), 0.99);
  EXPECT_LT(1.3 * detectable, detects * expected) << "too few samples to see the error";
  const statistics::TestResult right = statistics::t_test(means, expected);
  EXPECT_TRUE(right.accepted) << right.message;
  for (const Bug bug : bugs)
    EXPECT_FALSE(statistics::t_test(image_means(load_text(xml, 0, with(bug)), spp), expected).accepted) << name_of(bug);
}

/// The same for scenes in which all samples have the same value.
void expect_exact(const std::string& xml, double expected, std::initializer_list<Bug> bugs) {
  EXPECT_NEAR(image_mean(render(load_text(xml), 4, 0)), expected, 1e-4);
  for (const Bug bug : bugs)
    EXPECT_GT(std::abs(image_mean(render(load_text(xml, 0, with(bug)), 4, 0)) - expected), 1e-3) << name_of(bug);
}

std::string furnace(double albedo, int max_depth, const std::string& extra = "") {
  const std::string a = std::to_string(albedo);
  return scene_text(
      "<shape type='cube'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'><rgb "
      "name='reflectance' value='" +
          a +
          "'/></bsdf><emitter type='area'><rgb name='radiance' value='1'/>"
          "</emitter></shape>" +
          extra,
      16, 16, max_depth);
}

// In a closed box with emission 1 and albedo a, L = 1 + a L.
TEST(Furnace, UnlimitedDepthGivesTheGeometricSeries) {
  expect_image_mean(furnace(0.3, -1), 16, 1 / (1 - 0.3), 0.02,
                    {Bug::kNoDirectionWeight, Bug::kNoLightWeight, Bug::kCosineForgotten});
  expect_image_mean(furnace(0.6, -1), 32, 1 / (1 - 0.6), 0.03,
                    {Bug::kNoDirectionWeight, Bug::kNoLightWeight, Bug::kSurvivorsNotRaised});
}

TEST(Furnace, DepthCutGivesThePartialSum) {
  const double a = 0.7;
  double sum = 0;
  for (int depth = 1; depth <= 6; ++depth) {
    sum += std::pow(a, depth - 1);
    SCOPED_TRACE(depth);
    if (depth == 1)
      EXPECT_FLOAT_EQ(static_cast<float>(image_mean(render(load_text(furnace(a, 1)), 4, 0))), 1.0f);
    else
      expect_image_mean(furnace(a, depth), 16, sum, 0.02, {Bug::kNoDirectionWeight});
  }
}

TEST(Furnace, RouletteFromTheFirstEdgeIsUnbiased) {
  const std::string text = furnace(0.5, -1);
  const std::string with_roulette =
      std::string(text).insert(text.find("</integrator>"), "<integer name='rr_depth' value='1'/>");
  expect_image_mean(with_roulette, 64, 2, 0.03, {Bug::kSurvivorsNotRaised});
}

TEST(PathLengths, SingleLengthsAddUpToTheWhole) {
  // All renders use the same random numbers, so this is exact up to rounding.
  const int max_depth = 7;
  const Film whole = render(load_text(furnace(0.5, max_depth)), 8, 3);
  std::vector<double> sums(16 * 16);
  for (int depth = 1; depth <= max_depth; ++depth) {
    const Film part = render(load_text(furnace(0.5, depth), depth), 8, 3);
    for (int i = 0; i < 256; ++i) sums[i] += part.mean(i % 16, i / 16).g;
  }
  for (int i = 0; i < 256; ++i) EXPECT_NEAR(sums[i], whole.mean(i % 16, i / 16).g, 1e-4);
}

TEST(PathLengths, ZeroIsBlack) { EXPECT_EQ(image_mean(render(load_text(furnace(0.5, 0)), 1, 0)), 0); }

// In a dark room with unlimited depth, only Russian roulette ends paths; one with a NaN throughput is a bad sample.
TEST(PathLengths, AThroughputThatIsNotANumberEnds) {
  const std::string dark_room =
      "<shape type='cube'><boolean name='flip_normals' value='true'/><bsdf type='diffuse'/></shape>";
  const TestScene scene = load_text(scene_text(dark_room, 8, 8), 0, with(Bug::kNotANumber));
  Film film = new_film(scene);
  PassSettings settings;
  settings.spp = 2;
  EXPECT_EQ(render_pass(scene.scene(), scene.integrator(), settings, film).n_not_finite, 128u);
  EXPECT_EQ(image_mean(film), 0);
}

// A diffuse plane at z = 4 that faces the camera, lit from the camera's side.
const char* const kPlane =
    "<shape type='rectangle'><transform name='to_world'><scale value='50'/><rotate x='1' angle='180'/><translate "
    "z='4'/>"
    "</transform><bsdf type='diffuse'><rgb name='reflectance' value='0.6'/></bsdf></shape>";
const char* const kNarrow = "<float name='fov' value='0.01'/>";  // every pixel sees the point (0, 0, 4)

const char* const kPointLight =
    "<emitter type='point'><point name='position' x='3' y='0' z='0'/><rgb name='intensity' value='10'/></emitter>";

TEST(DirectLight, PointLightOverAPlane) {
  // L = albedo / pi * I cos / d^2 with d = 5 and cos = 4/5.
  expect_exact(scene_text(std::string(kPlane) + kPointLight, 4, 4, 2, kNarrow), 0.6 / M_PI * 10 * 0.8 / 25,
               {Bug::kCosineForgotten});
}

TEST(DirectLight, DirectionalLight) {
  const std::string light =
      "<emitter type='directional'><vector name='direction' x='0' y='3' z='4'/><rgb name='irradiance' "
      "value='2'/></emitter>";
  expect_exact(scene_text(kPlane + light, 4, 4, 2, kNarrow), 0.6 / M_PI * 2 * 0.8, {Bug::kCosineForgotten});
}

TEST(DirectLight, TwoEqualPointLights) {
  // Both lights give the same value.
  expect_exact(scene_text(std::string(kPlane) + kPointLight + kPointLight, 4, 4, 2, kNarrow),
               2 * 0.6 / M_PI * 10 * 0.8 / 25, {Bug::kLightPmfForgotten, Bug::kCosineForgotten});
}

const char* const kSphereLight =
    "<shape type='sphere'><point name='center' x='3' y='0' z='0'/><emitter type='area'><rgb name='radiance' value='7'/>"
    "</emitter></shape>";

TEST(DirectLight, SphereLight) {
  // Irradiance from a sphere with radiance L and radius r at distance d: pi L (r/d)^2 cos.
  expect_image_mean(scene_text(std::string(kPlane) + kSphereLight, 16, 16, 2, kNarrow), 16, 0.6 * 7 * (1.0 / 25) * 0.8,
                    0.02, {Bug::kNoDirectionWeight, Bug::kCosineForgotten});
}

TEST(DirectLight, DiskLight) {
  // Irradiance from a coaxial disk with radius r at distance d: pi L r^2 / (r^2 + d^2). The camera lies behind it.
  const std::string disk =
      "<shape type='disk'><transform name='to_world'><scale value='2'/><translate z='-1'/></transform>"
      "<emitter type='area'><rgb name='radiance' value='3'/></emitter></shape>";
  expect_image_mean(scene_text(kPlane + disk, 16, 16, 2, kNarrow), 16, 0.6 * 3 * 4.0 / (4 + 25), 0.02,
                    {Bug::kNoDirectionWeight, Bug::kNoLightWeight, Bug::kCosineForgotten});
}

TEST(DirectLight, HiddenDiskLight) {
  // As above, between the camera and the plane, at distance 3: rays pass through it.
  const std::string disk =
      "<shape type='disk'><transform name='to_world'><scale value='2'/><translate z='1'/></transform>"
      "<emitter type='area'><rgb name='radiance' value='3'/><boolean name='hidden' value='true'/></emitter></shape>";
  expect_image_mean(scene_text(kPlane + disk, 16, 16, 2, kNarrow), 16, 0.6 * 3 * 4.0 / (4 + 9), 0.02,
                    {Bug::kCosineForgotten});
}

TEST(DirectLight, EachInstanceOfALightShines) {
  // Two instances of a sphere light: the one of SphereLight, and one twice as large in the same direction at twice the
  // distance; neither is occluded. Each gives pi L (r/d)^2 cos.
  const std::string group =
      "<shape type='shapegroup' id='lamp'><shape type='sphere'><emitter type='area'><rgb "
      "name='radiance' value='7'/></emitter></shape></shape>";
  const std::string place = "<shape type='instance'><ref id='lamp'/><transform name='to_world'>%</transform></shape>";
  std::string instances;
  for (const char* transform : {"<translate x='3'/>", "<scale value='2'/><translate x='-6' z='-4'/>"})
    instances += std::string(place).replace(place.find('%'), 1, transform);
  const std::string xml = scene_text(kPlane + group + instances, 16, 16, 2, kNarrow);
  EXPECT_EQ(load_text(xml).scene().emitters().size(), 2u);
  expect_image_mean(xml, 32, 2 * 0.6 * 7 * (1.0 / 25) * 0.8, 0.02, {Bug::kLightPmfForgotten});
}

const char* const kDimSky = "<emitter type='constant'><rgb name='radiance' value='0.25'/></emitter>";

TEST(DirectLight, ConstantEnvironment) {
  expect_image_mean(scene_text(std::string(kPlane) + kDimSky, 16, 16, 2, kNarrow), 32, 0.6 * 0.25, 0.02,
                    {Bug::kNoDirectionWeight, Bug::kNoLightWeight, Bug::kCosineForgotten});
}

/// The parts of `path`, but with lights chosen by power.
struct PartsWithPowerLights : PathParts {
  std::shared_ptr<const PowerLights> power_lights;
  void prepare(const Scene& scene) { power_lights = std::make_shared<PowerLights>(scene); }
  const PowerLights& lights(const Scene&) const { return *power_lights; }
};

TEST(DirectLight, TwoLightsAddUp) {
  const std::string xml = scene_text(std::string(kPlane) + kSphereLight + kDimSky, 16, 16, 2, kNarrow);
  // The sphere occludes the environment behind it, hence 7 - 0.25 within its solid angle.
  const double expected = 0.6 * ((7 - 0.25) * 0.8 / 25 + 0.25);
  expect_image_mean(xml, 32, expected, 0.02, {Bug::kNoDirectionWeight, Bug::kNoLightWeight, Bug::kLightPmfForgotten});

  const TestScene by_power = load_text(xml, 0, [](const PathLengthSettings& lengths) {
    return std::make_shared<PathTracer<PartsWithPowerLights>>("path", lengths);
  });
  const statistics::TestResult right = statistics::t_test(image_means(by_power, 32), expected);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(same_bits(render(by_power, 32, 0), render(load_text(xml), 32, 0)));
}

TEST(Glass, RadianceIsScaledWhereItLeavesAMedium) {
  // A light inside a dielectric with n = 1.5, seen from outside at normal incidence: (1 - F) L / n^2 with
  // F = ((n - 1) / (n + 1))^2.
  const std::string face =
      "<shape type='rectangle'><transform name='to_world'><scale value='50'/><rotate x='1' angle='180'/>"
      "<translate z='%'/></transform>";
  const std::string glass = std::string(face).replace(face.find('%'), 1, "2") +
                            "<bsdf type='dielectric'><float name='int_ior' value='1.5'/><float name='ext_ior' "
                            "value='1'/></bsdf></shape>";
  const std::string lamp = std::string(face).replace(face.find('%'), 1, "4") +
                           "<emitter type='area'><rgb name='radiance' value='3'/></emitter></shape>";
  expect_image_mean(scene_text(glass + lamp, 16, 16, 3, kNarrow), 32, 0.96 * 3 / 2.25, 0.02,
                    {Bug::kRadianceNotScaled, Bug::kLobePmfForgotten});
}

TEST(Mask, LightBehindHalfOpaqueSurfaces) {
  // Two black surfaces with opacity 0.5 in front of a constant environment transmit a quarter of it.
  const std::string veil =
      "<shape type='rectangle'><transform name='to_world'><scale value='50'/><translate z='%'/>"
      "</transform><bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='diffuse'><rgb "
      "name='reflectance' value='0'/></bsdf></bsdf></shape>";
  std::string two;
  for (const char* z : {"2", "3"}) two += std::string(veil).replace(veil.find('%'), 1, z);
  const std::string sky = "<emitter type='constant'><rgb name='radiance' value='8'/></emitter>";
  expect_image_mean(scene_text(two + sky, 16, 16, -1, kNarrow), 32, 2, 0.05, {Bug::kLobePmfForgotten});
}

TEST(HideEmitters, LightsAreInvisibleButShine) {
  const std::string body =
      std::string(kPlane) +
      "<shape type='rectangle'><transform name='to_world'><translate z='1'/></transform><emitter type='area'><rgb "
      "name='radiance' value='5'/></emitter></shape>";
  const std::string hide = "<boolean name='hide_emitters' value='true'/>";
  // A rectangle of 2 x 2 between camera and plane faces the plane at a distance of 3: the form factor of four unit
  // squares over a point below their common corner.
  const double a = 1.0 / 3, s = std::sqrt(1 + a * a);
  const double irradiance = 5 * 4 * 0.5 * 2 * (a / s) * std::atan(a / s);
  expect_image_mean(scene_text(body, 16, 16, 2, kNarrow, hide), 16, 0.6 / M_PI * irradiance, 0.02,
                    {Bug::kNoDirectionWeight, Bug::kNoLightWeight});
  const std::string sky = "<emitter type='constant'/>";
  EXPECT_EQ(image_mean(render(load_text(scene_text(sky, 4, 4, -1, "", hide)), 1, 0)), 0);
  EXPECT_EQ(image_mean(render(load_text(scene_text(sky, 4, 4, -1, "")), 1, 0)), 1);
}

/// The largest relative difference of two images' pixels.
double largest_difference(const Film& a, const Film& b) {
  double largest = 0;
  for (int y = 0; y < a.height(); ++y)
    for (int x = 0; x < a.width(); ++x) {
      const double value = mean(a.mean(x, y)), other = mean(b.mean(x, y));
      largest = std::max(largest, std::abs(value - other) / std::max(other, 1e-3));
    }
  return largest;
}

TEST(PlantedBugs, WithoutOneThePartsGiveTheImagesOfPath) {
  // `path` samples lights several at a time. For spheres GCC 12 rounds as it does one at a time, GCC 14 fuses other
  // products and sums.
  const std::string around =
      "<shape type='sphere'><float name='radius' value='90'/><boolean name='flip_normals' value='true'/>"
      "<emitter type='area'><rgb name='radiance' value='0.5'/></emitter></shape>";
  for (const std::string& light : {std::string(kDimSky), around}) {
    const std::string xml = scene_text(kPlane + (kSphereLight + light), 16, 16, -1, "");
    const Film film = render(load_text(xml), 8, 0), of_parts = render(load_text(xml, 0, with(Bug::kNone)), 8, 0);
    EXPECT_LT(largest_difference(film, of_parts), 1e-5);
    EXPECT_EQ(film.counts(), of_parts.counts());
  }
}

}  // namespace
}  // namespace covary
