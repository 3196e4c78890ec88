// SPDX-License-Identifier: Apache-2.0
// A square image on the sphere of directions whose texels cover equal solid angles, as used by pbrt-v4's infinite
// lights (core/equal_area.h). Texels are constant, not interpolated, like pbrt's lookups.
#pragma once

#include "emitters/environment_image.h"

namespace covary {

/// Same interface as EnvironmentImage; the density follows the luminance of the texels.
class EqualAreaImage {
 public:
  /// `image`: linear RGB floats as from read_linear_rgb(). Throws Error(kInput) if it is not square.
  EqualAreaImage(TexelImage image, float scale, bool mis_compensation);
  EqualAreaImage compensated() const { return {image_, 1, true}; }
  bool is_compensated() const { return compensated_; }

  using Lookup = EnvironmentImage::Lookup;
  Lookup lookup(const Vec3& d) const;

  using Sample = EnvironmentImage::Sample;
  Sample sample(Vec2 u) const;

  /// Integral of the value over the sphere of directions.
  const Spectrum& integral() const { return integral_; }

 private:
  Spectrum at(Vec2 uv) const;
  TexelImage image_;  // scaled
  PiecewiseConstant2D texels_;
  Spectrum integral_;
  bool compensated_;
};

/// Resamples to the mapping of EnvironmentImage, twice the width and the original height; each texel is a mean of its
/// surroundings. For programs that only support that mapping; features of texel size become blurred.
TexelImage latitude_longitude_of(const TexelImage& equal_area);

}  // namespace covary
