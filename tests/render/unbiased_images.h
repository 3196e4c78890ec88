// SPDX-License-Identifier: Apache-2.0
// Tests whether two integrators estimate the same image: renders with many seeds, Student's t-test on the means of 16
// blocks and of the whole image; and a scene with every kind of light and many kinds of surfaces.
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

/// A scene with every kind of light, delta lights only if wanted, and many kinds of surfaces.
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

/// Differences of the block means and, last, of the image mean, for each of 16 seeds.
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

/// Differences between the images of a and b for each seed.
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

/// `shift`: seeds of b minus those of a.
inline Differences differences(const TestScene& a, const TestScene& b, uint32_t spp, uint64_t shift) {
  return differences([&](uint64_t seed) { return render(a, spp, seed).mean_image(); },
                     [&](uint64_t seed) { return render(b, spp, seed + shift).mean_image(); });
}

/// Number of means, of blocks or of the image, whose difference is significant.
inline int n_biased(const Differences& blocks) {
  int n = 0;
  for (const std::vector<double>& values : blocks) n += !statistics::t_test(values, 0).accepted;
  return n;
}

/// The smallest difference of image means that is detected with power 0.99.
inline double detectable(const Differences& blocks) {
  statistics::Moments moments;
  for (const double difference : blocks.back()) moments.add(difference);
  return statistics::smallest_detectable(std::sqrt(moments.sample_variance()), 16, statistics::test_alpha(), 0.99);
}

/// Sum of squared differences between two renders with different random numbers: twice the variance.
inline double noise(const TestScene& scene) {
  const Film a = render(scene, 8, 1), b = render(scene, 8, 2);
  double sum = 0;
  for (int y = 0; y < kSide; ++y)
    for (int x = 0; x < kSide; ++x)
      for (int c = 0; c < 3; ++c) sum += sqr(a.mean(x, y)[c] - b.mean(x, y)[c]);
  return sum;
}

}  // namespace covary
