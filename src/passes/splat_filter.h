// SPDX-License-Identifier: Apache-2.0
// Reconstruction filters for splats, which fall anywhere on the film: the counterpart of film_position() in
// render_pass.h.
#pragma once

#include "core/vec.h"
#include "scene/scene.h"

namespace covary {

/// A pixel of the full frame, or outside it, that receives a splat times `weight`; none if that is 0.
struct SplatPixel {
  int x = 0, y = 0;
  float weight = 0;
};

/// Chooses the one pixel that a splat belongs to. A pixel's mean is an integral over the film with the filter h around
/// its centre as a density, so a splat at a film position adds h times its value to each pixel within the filter's
/// radius. One of these is chosen with probability proportional to |h|, and gets the value times the sum of |h| over
/// all of them, with the sign of h: one splat, one pixel, like camera samples.
class SplatFilter {
 public:
  explicit SplatFilter(const FilterSettings& filter);
  /// `film`: position in pixels of the full frame, which it may leave; `u` uniform in [0,1)^2.
  SplatPixel pixel(Vec2 film, Vec2 u) const;

 private:
  struct Choice {
    int pixel = 0;
    float weight = 0;
  };
  /// h along one axis, at a distance from the pixel's centre within the radius; its integral is 1.
  double density(double distance) const;
  Choice choose(double position, double u) const;

  FilterSettings filter_;
  double scale_ = 1;  // of the gaussian
};

}  // namespace covary
