// SPDX-License-Identifier: Apache-2.0
// A point on a surface, as found by the ray tracer or sampled by an emitter.
#pragma once

#include <cstdint>

#include "core/frame.h"
#include "core/spectrum.h"

namespace covary {

class Shape;
class Bsdf;
class Emitter;

struct SurfaceHit {
  float t = kInfinity;  ///< distance along the ray
  Vec3 p;               ///< position
  Vec3 ng;              ///< unit geometric normal (the side depends on the shape's orientation, not on the ray)
  Frame frame;          ///< shading frame; frame.n is the interpolated normal
  Vec2 uv;              ///< surface parameters
  Vec3 dp_du, dp_dv;    ///< position derivatives; only set if bsdf->needs_derivatives()
  const Shape* shape = nullptr;
  const Bsdf* bsdf = nullptr;        ///< never null for a hit
  uint32_t bsdf_flags = 0;           ///< of bsdf
  float offset = 0;                  ///< of the origins of rays leaving it, along ng (core/rounding.h)
  const Emitter* emitter = nullptr;  ///< area light of this surface, or null
  uint32_t primitive = 0;            ///< triangle index within a mesh
  Vec2 barycentric;                  ///< weights of the triangle's 2nd and 3rd vertex

  /// Interpolated vertex colour; see Shape::vertex_colour.
  Spectrum vertex_colour() const;
};

}  // namespace covary
