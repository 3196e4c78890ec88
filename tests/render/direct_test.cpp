// SPDX-License-Identifier: Apache-2.0
// `direct` against `path` with at most two edges, for several sample counts, and `depth` against distances.
//
// Renders are the independent units: 16 seeds, Student's t-test on block means (unbiased_images.h). The test asserts
// that it detects an error of 1 % of the image mean with power 0.99; lights with 1.03 times the power are rejected.
#include <gtest/gtest.h>

#include "unbiased_images.h"

namespace covary {
namespace {

std::string with_integrator(std::string scene, const std::string& integrator) {
  const size_t begin = scene.find("<integrator"), end = scene.find("</integrator>");
  return scene.replace(begin, end - begin, integrator);
}

std::string direct(const std::string& parameters) { return "<integrator type='direct'>" + parameters; }
std::string count(const char* name, int n) {
  return std::string("<integer name='") + name + "' value='" + std::to_string(n) + "'/>";
}
const std::string kTwoEdges = "<integrator type='path'><integer name='max_depth' value='2'/>";

TEST(Direct, IsPathOfTwoEdges) {
  const TestScene path = load_text(with_integrator(everything(), kTwoEdges));
  const std::string counts[] = {"", count("shading_samples", 3),
                                count("emitter_samples", 1) + count("bsdf_samples", 4)};
  for (const std::string& parameters : counts) {
    const TestScene other = load_text(with_integrator(everything(), direct(parameters)));
    const Differences blocks = differences(path, other, 64, 100);
    EXPECT_EQ(n_biased(blocks), 0) << parameters;
    EXPECT_LT(detectable(blocks), 0.01 * block_mean(render(path, 64, 1).mean_image(), kBlocks * kBlocks));
  }
}

TEST(Direct, OneTechniqueAlone) {
  // Without delta lights and mirrors, either technique finds all light.
  std::string scene = everything("", false);
  for (const char* glass : {"dielectric", "plastic"}) {
    const size_t at = scene.find(std::string("<bsdf type='") + glass + "'");
    scene.replace(at, scene.find("/>", at) - at, "<bsdf type='diffuse'");
  }
  const size_t mask = scene.find("<float name='opacity' value='0.5'/>");
  scene.replace(mask, 35, "<float name='opacity' value='1.0'/>");
  const TestScene path = load_text(with_integrator(scene, kTwoEdges));
  for (const auto& [lights, directions] : {std::pair{2, 0}, std::pair{0, 2}}) {
    const std::string parameters = count("emitter_samples", lights) + count("bsdf_samples", directions);
    const TestScene other = load_text(with_integrator(scene, direct(parameters)));
    EXPECT_EQ(n_biased(differences(path, other, 64, 100)), 0) << parameters;
  }
  std::string brighter = scene;
  const size_t light = brighter.find("<rgb name='radiance' value='8,2,1'/>");
  brighter.replace(light, 36, "<rgb name='radiance' value='9.6,2.4,1.2'/>");
  EXPECT_GT(n_biased(differences(path, load_text(with_integrator(brighter, direct(""))), 64, 100)), 0);
}

TEST(Direct, NeedsASample) {
  EXPECT_THROW(load_text(with_integrator(everything(), direct(count("emitter_samples", 0) + count("bsdf_samples", 0)))),
               Error);
}

TEST(Depth, IsTheDistanceFromTheNearPlane) {
  const std::string wall = rectangle("<scale value='100'/><rotate x='1' angle='180'/><translate z='5'/>", "");
  const TestScene scene = load_text(
      with_integrator(scene_text(wall, 9, 9, -1, "<float name='near_clip' value='1'/>"), "<integrator type='depth'>"));
  const Film film = render(scene, 64, 1);
  EXPECT_NEAR(film.mean(4, 4).r, 4, 0.05);
  EXPECT_EQ(film.mean(4, 4).r, film.mean(4, 4).b);
  EXPECT_GT(film.mean(0, 0).r, 4.2);
}

}  // namespace
}  // namespace covary
