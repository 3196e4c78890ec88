// SPDX-License-Identifier: Apache-2.0
// An image on the sphere of directions, and a sampler whose density follows its bilinear interpolation.
//
// Mapping (Mitsuba 3's): u = atan2(x, -z) / 2 pi wraps around, v = acos(y) / pi runs from the top (+y) to the bottom.
// Texel column i has its centre at u = (i + 0.5) / width; row j stands at v = j / (height - 1), the first and the last
// row on the poles.
//
// Sampling. With h the tent functions of the interpolation, texel weights l_ij = max(0, luminance - offset) and
// s(v) the linear interpolation of sin(pi v) between rows, the density per unit (u, v) area is
//     p(u, v) = sum_ij l_ij h_i(u) h_j(v) s(v) / Z.
// It is drawn by choosing a texel, then a position within its tent. Per unit solid angle that is, up to s(v)/sin(pi v)
// (one but for a term of second order in the height of a row), the luminance over its integral over the sphere: the
// estimate of the light from the map is nearly constant however small the sun, and the density is positive wherever
// the interpolated luminance is.
#pragma once

#include <vector>

#include "core/distribution.h"
#include "core/spectrum.h"
#include "core/vec.h"
#include "textures/image.h"

namespace covary {

class EnvironmentImage {
 public:
  /// `image`: linear RGB floats as from read_linear_rgb; at least one pixel; one of fewer than three rows repeats its
  /// last row. `scale` multiplies all values, >= 0.
  /// `mis_compensation`: subtract the mean luminance from the sampling weights (Karlík et al. 2019), for use together
  /// with a technique that covers all directions.
  EnvironmentImage(const TexelImage& image, float scale, bool mis_compensation);

  struct Lookup {
    Spectrum value;
    float pdf_solid_angle;  ///< density of sample() at the direction
  };
  Lookup lookup(const Vec3& d) const;

  struct Sample {
    Vec3 d;
    Spectrum value;
    float pdf_solid_angle;  ///< 0 when the image is black
  };
  Sample sample(Vec2 u) const;

  /// Integral of the value over the sphere of directions.
  const Spectrum& integral() const { return integral_; }

 private:
  struct Texel {
    Spectrum value;
    float weight;  // l
  };
  /// Value and the sampling density per unit (u, v) area at u in [0, 1], v in [0, 1].
  struct UvLookup {
    Spectrum value;
    float pdf_uv;
  };
  UvLookup lookup_uv(float u, float v) const;
  float sample_row_offset(int row, float u) const;

  int width_, height_;
  std::vector<Texel> texels_;  // rows of width + 1, the last repeats the first
  std::vector<float> sines_;   // sin(theta) of each row
  Discrete rows_;              // empty when nothing is to be sampled
  std::vector<Discrete> columns_;
  bool black_ = true;
  float inverse_z_ = 0;
  Spectrum integral_;
};

}  // namespace covary
