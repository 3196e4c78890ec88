// SPDX-License-Identifier: Apache-2.0
// Renders whose result is known in closed form.
//
// Statistical cases: R = 32 renders with seeds 0 … 31, Student's t-test of the image mean at alpha = 5e-7 (|t_31| >
// 6.3). With the standard error s of the mean of the 32 renders, the test rejects an error of 6.3 s + 2.5 s = 8.8 s
// with power 0.99; each case asserts that this is below the error that it plants, so the test cannot pass for lack of
// samples.
#include <cmath>

#include "render_fixture.h"
#include "statistics/p_values.h"

namespace covary {
namespace {

constexpr int kRenders = 32;

/// Accepts `expected`, rejects `expected * (1 + planted)` and `expected * (1 - planted)`.
void expect_image_mean(const TestScene& scene, uint32_t spp, double expected, double planted) {
  std::vector<double> means;
  statistics::Moments moments;
  for (int seed = 0; seed < kRenders; ++seed) {
    means.push_back(image_mean(render(scene, spp, seed)));
    moments.add(means.back());
  }
  const double detectable =
      statistics::smallest_detectable(std::sqrt(moments.sample_variance()), kRenders, statistics::test_alpha(), 0.99);
  EXPECT_LT(1.3 * detectable, planted * expected) << "too few samples to see the planted error";
  const statistics::TestResult right = statistics::t_test(means, expected);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(statistics::t_test(means, expected * (1 + planted)).accepted);
  EXPECT_FALSE(statistics::t_test(means, expected * (1 - planted)).accepted);
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

// Radiance in a closed box that emits 1 and reflects a: L = 1 + a L.
TEST(Furnace, UnlimitedDepthGivesTheGeometricSeries) {
  expect_image_mean(load_text(furnace(0.3, -1)), 16, 1 / (1 - 0.3), 0.02);
  expect_image_mean(load_text(furnace(0.6, -1)), 32, 1 / (1 - 0.6), 0.03);
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
      expect_image_mean(load_text(furnace(a, depth)), 16, sum, 0.02);
  }
}

TEST(Furnace, RouletteFromTheFirstEdgeIsUnbiased) {
  const std::string text = furnace(0.5, -1);
  const std::string with_roulette =
      std::string(text).insert(text.find("</integrator>"), "<integer name='rr_depth' value='1'/>");
  expect_image_mean(load_text(with_roulette), 64, 2, 0.03);
}

TEST(PathLengths, SingleLengthsAddUpToTheWhole) {
  // The same random numbers decide whatever is left out, so this is exact up to rounding.
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

// A diffuse plane z = 4 facing the camera, lit from the camera's side.
const char* const kPlane =
    "<shape type='rectangle'><transform name='to_world'><scale value='50'/><rotate x='1' angle='180'/><translate "
    "z='4'/>"
    "</transform><bsdf type='diffuse'><rgb name='reflectance' value='0.6'/></bsdf></shape>";
const char* const kNarrow = "<float name='fov' value='0.01'/>";  // all pixels see the point (0, 0, 4)

TEST(DirectLight, PointLightOverAPlane) {
  // L = albedo / pi * I cos / d^2 at distance 5 under the angle with cosine 4/5.
  const TestScene scene = load_text(scene_text(
      std::string(kPlane) + "<emitter type='point'><point name='position' x='3' y='0' z='0'/><rgb name='intensity' "
                            "value='10'/></emitter>",
      4, 4, 2, kNarrow));
  EXPECT_NEAR(image_mean(render(scene, 4, 0)), 0.6 / M_PI * 10 * 0.8 / 25, 1e-4);
}

TEST(DirectLight, DirectionalLight) {
  const TestScene scene = load_text(
      scene_text(std::string(kPlane) + "<emitter type='directional'><vector name='direction' x='0' y='3' z='4'/><rgb "
                                       "name='irradiance' value='2'/></emitter>",
                 4, 4, 2, kNarrow));
  EXPECT_NEAR(image_mean(render(scene, 4, 0)), 0.6 / M_PI * 2 * 0.8, 1e-4);
}

TEST(DirectLight, SphereLight) {
  // Irradiance of a sphere of radiance L and radius r at distance d in direction cos: pi L (r/d)^2 cos.
  const TestScene scene = load_text(scene_text(
      std::string(kPlane) + "<shape type='sphere'><point name='center' x='3' y='0' z='0'/><float name='radius' "
                            "value='1'/><emitter type='area'><rgb name='radiance' value='7'/></emitter></shape>",
      16, 16, 2, kNarrow));
  expect_image_mean(scene, 16, 0.6 * 7 * (1.0 / 25) * 0.8, 0.02);
}

TEST(DirectLight, DiskLight) {
  // Irradiance of a coaxial disk of radius r at distance d: pi L r^2 / (r^2 + d^2). The camera looks through it.
  const TestScene scene = load_text(scene_text(
      std::string(kPlane) + "<shape type='disk'><transform name='to_world'><scale value='2'/><translate z='-1'/>"
                            "</transform><emitter type='area'><rgb name='radiance' value='3'/></emitter></shape>",
      16, 16, 2, kNarrow));
  expect_image_mean(scene, 16, 0.6 * 3 * 4.0 / (4 + 25), 0.02);
}

TEST(DirectLight, EachInstanceOfALightShines) {
  // Two placed copies of a sphere light that emits: the one of SphereLight, and one twice as large at the same
  // direction and twice the distance, hidden behind nothing: each gives pi L (r/d)^2 cos.
  const std::string group =
      "<shape type='shapegroup' id='lamp'><shape type='sphere'><emitter type='area'><rgb "
      "name='radiance' value='7'/></emitter></shape></shape>";
  const std::string place = "<shape type='instance'><ref id='lamp'/><transform name='to_world'>%</transform></shape>";
  std::string instances;
  for (const char* transform : {"<translate x='3'/>", "<scale value='2'/><translate x='-6' z='-4'/>"})
    instances += std::string(place).replace(place.find('%'), 1, transform);
  const TestScene scene = load_text(scene_text(kPlane + group + instances, 16, 16, 2, kNarrow));
  EXPECT_EQ(scene.scene().emitters().size(), 2u);
  expect_image_mean(scene, 32, 2 * 0.6 * 7 * (1.0 / 25) * 0.8, 0.02);
}

TEST(DirectLight, ConstantEnvironment) {
  const TestScene scene = load_text(
      scene_text(std::string(kPlane) + "<emitter type='constant'><rgb name='radiance' value='0.25'/></emitter>", 16, 16,
                 2, kNarrow));
  expect_image_mean(scene, 32, 0.6 * 0.25, 0.02);
}

TEST(DirectLight, TwoLightsAddUp) {
  const std::string sphere =
      "<shape type='sphere'><point name='center' x='3' y='0' z='0'/><emitter type='area'><rgb "
      "name='radiance' value='7'/></emitter></shape>";
  const TestScene scene = load_text(scene_text(
      std::string(kPlane) + sphere + "<emitter type='constant'><rgb name='radiance' value='0.25'/></emitter>", 16, 16,
      2, kNarrow));
  // The sphere hides its part of the environment: (7 - 0.25) for its share.
  expect_image_mean(scene, 32, 0.6 * ((7 - 0.25) * 0.8 / 25 + 0.25), 0.02);
}

TEST(Mask, LightBehindHalfOpaqueSurfaces) {
  // Two black surfaces of opacity 0.5 before a constant environment: a quarter of it arrives.
  const std::string veil =
      "<shape type='rectangle'><transform name='to_world'><scale value='50'/><translate z='%'/>"
      "</transform><bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='diffuse'><rgb "
      "name='reflectance' value='0'/></bsdf></bsdf></shape>";
  std::string two;
  for (const char* z : {"2", "3"}) two += std::string(veil).replace(veil.find('%'), 1, z);
  const TestScene scene = load_text(
      scene_text(two + "<emitter type='constant'><rgb name='radiance' value='8'/></emitter>", 16, 16, -1, kNarrow));
  expect_image_mean(scene, 32, 2, 0.05);
}

TEST(HideEmitters, LightsAreInvisibleButShine) {
  const std::string body =
      std::string(kPlane) +
      "<shape type='rectangle'><transform name='to_world'><translate z='1'/></transform><emitter type='area'><rgb "
      "name='radiance' value='5'/></emitter></shape>";
  const std::string hide = "<boolean name='hide_emitters' value='true'/>";
  // The rectangle 2 x 2 lies between camera and plane and faces the plane, seen at distance 3 from its centre. Form
  // factor of four unit squares over a point below their common corner.
  const double a = 1.0 / 3, s = std::sqrt(1 + a * a);
  const double irradiance = 5 * 4 * 0.5 * 2 * (a / s) * std::atan(a / s);
  expect_image_mean(load_text(scene_text(body, 16, 16, 2, kNarrow, hide)), 16, 0.6 / M_PI * irradiance, 0.02);
  const std::string sky = "<emitter type='constant'/>";
  EXPECT_EQ(image_mean(render(load_text(scene_text(sky, 4, 4, -1, "", hide)), 1, 0)), 0);
  EXPECT_EQ(image_mean(render(load_text(scene_text(sky, 4, 4, -1, "")), 1, 0)), 1);
}

}  // namespace
}  // namespace covary
