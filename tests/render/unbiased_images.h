// SPDX-License-Identifier: Apache-2.0
// Do two integrators estimate the same image? Renders of many seeds, Student's t-test on the means of 16 blocks of the
// image and of the whole. A scene with lights of every kind, and surfaces of many, to try it on.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "render_fixture.h"
#include "statistics/p_values.h"

namespace covary {

inline constexpr int kSide = 32, kBlocks = 4;
inline const std::string kWide = "<float name='fov' value='75'/>";

inline std::string rectangle(const char* transform, const char* content) {
  return std::string("<shape type='rectangle'><transform name='to_world'>") + transform + "</transform>" + content +
         "</shape>";
}

inline std::string sphere(const char* centre, const char* content) {
  return std::string("<shape type='sphere'><point name='center' ") + centre + "/>" + content + "</shape>";
}

inline const std::string kFloor =
    rectangle("<scale value='6'/><rotate x='1' angle='-90'/><translate y='-2' z='5'/>",
              "<bsdf type='diffuse'><rgb name='reflectance' value='0.6,0.5,0.3'/></bsdf>");
inline const std::string kMeshLight =
    "<shape type='cube'><transform name='to_world'><scale value='0.4'/><translate x='2' y='2' z='5'/></transform>"
    "<emitter type='area'><rgb name='radiance' value='8,2,1'/></emitter></shape>";

/// Lights of every kind, those at a point or in one direction only if wanted, and surfaces of many.
inline std::string everything(const std::string& integrator = "<integer name='rr_depth' value='3'/>",
                              bool delta_lights = true) {
  const std::string points =
      "<emitter type='point'><point name='position' x='1' y='2' z='3'/></emitter>"
      "<emitter type='spot'><transform name='to_world'><lookat origin='-2,3,2' target='0,-2,5' up='0,0,1'/>"
      "</transform></emitter>"
      "<emitter type='directional'><vector name='direction' x='1' y='-2' z='1'/></emitter>";
  return scene_text(
      kFloor + kMeshLight +
          rectangle("<scale value='6'/><rotate x='1' angle='180'/><translate z='9'/>",
                    "<bsdf type='roughconductor'><float name='alpha' value='0.3'/></bsdf>") +
          rectangle("<rotate x='1' angle='90'/><translate y='3' z='4'/>",
                    "<emitter type='area'><texture name='radiance' type='checkerboard'>"
                    "<rgb name='color0' value='0'/><rgb name='color1' value='1,5,8'/></texture></emitter>") +
          rectangle("<scale value='0.7'/><rotate y='1' angle='180'/><translate x='-1.5' y='0.5' z='3'/>",
                    "<bsdf type='mask'><float name='opacity' value='0.5'/><bsdf type='twosided'><bsdf type='diffuse'/>"
                    "</bsdf></bsdf>") +
          sphere("x='-3' y='-1' z='5'", "<bsdf type='plastic'/>") +
          sphere("x='0' y='-1' z='5'", "<bsdf type='dielectric'/>") +
          sphere("x='3' y='-1' z='5'", "<bsdf type='roughplastic'><float name='alpha' value='0.2'/></bsdf>") +
          sphere("x='-4' y='2' z='4'",
                 "<float name='radius' value='0.5'/><emitter type='area'><rgb name='radiance' value='4'/></emitter>") +
          "<emitter type='constant'><rgb name='radiance' value='0.3,0.4,0.6'/></emitter>" +
          (delta_lights ? points : ""),
      kSide, kSide, 5, kWide, integrator);
}

/// Differences of block means, and at the end of the mean of the image, for each of 16 seeds.
using Differences = std::vector<std::vector<double>>;

inline double block_mean(const Image& image, int block) {
  const bool whole = block == kBlocks * kBlocks;
  const int size = whole ? kSide : kSide / kBlocks;
  const int x0 = whole ? 0 : block % kBlocks * size, y0 = whole ? 0 : block / kBlocks * size;
  double sum = 0;
  for (int y = y0; y < y0 + size; ++y)
    for (int x = x0; x < x0 + size; ++x) sum += mean(image.rgb(x, y));
  return sum / (size * size);
}

/// Of the images that a and b make of each seed.
template <typename A, typename B>
Differences differences(const A& a, const B& b) {
  Differences result(kBlocks * kBlocks + 1);
  for (uint64_t seed = 0; seed < 16; ++seed) {
    const Image image_a = a(seed), image_b = b(seed);
    for (size_t block = 0; block < result.size(); ++block)
      result[block].push_back(block_mean(image_a, static_cast<int>(block)) -
                              block_mean(image_b, static_cast<int>(block)));
  }
  return result;
}

/// `shift`: by how much the seeds of b differ from those of a.
inline Differences differences(const TestScene& a, const TestScene& b, uint32_t spp, uint64_t shift) {
  return differences([&](uint64_t seed) { return render(a, spp, seed).mean_image(); },
                     [&](uint64_t seed) { return render(b, spp, seed + shift).mean_image(); });
}

/// Blocks whose difference has another mean than zero.
inline int n_biased(const Differences& blocks) {
  int n = 0;
  for (const std::vector<double>& values : blocks) n += !statistics::t_test(values, 0).accepted;
  return n;
}

/// The smallest difference of the image's means that is found with power 0.99.
inline double detectable(const Differences& blocks) {
  statistics::Moments moments;
  for (const double difference : blocks.back()) moments.add(difference);
  return statistics::smallest_detectable(std::sqrt(moments.sample_variance()), 16, statistics::test_alpha(), 0.99);
}

/// Sum of squared differences of two renders with other numbers: twice the variance.
inline double noise(const TestScene& scene) {
  const Film a = render(scene, 8, 1), b = render(scene, 8, 2);
  double sum = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 3; ++c) sum += sqr(a.mean(x, y)[c] - b.mean(x, y)[c]);
  return sum;
}

}  // namespace covary
