// SPDX-License-Identifier: Apache-2.0
// Shared by lights without extent.
#pragma once

#include <cmath>

#include "emitters/lattice.h"
#include "emitters/rotation.h"
#include "scene/emitter.h"
#include "scene/parameters.h"

namespace covary {

/// Position and orientation of such a light.
struct PointFrame {
  Vec3 position;
  Rotation rotation;
};
/// From `to_world`; records an error if it would distort directions.
inline PointFrame get_point_frame(Parameters& parameters) {
  const Transform to_world = parameters.get_transform("to_world");
  PointFrame frame{to_world.point({0, 0, 0}), {}};
  try {
    frame.rotation = Rotation(to_world);
  } catch (const Error& error) {
    parameters.error_at("to_world", error.what());
  }
  return frame;
}

/// Emitter::sample_towards() for a light at `position`; intensity(d) is its power per unit solid angle in direction d.
template <typename Intensity>
EmitterSample sample_point(const Vec3& position, const Vec3& reference, const Intensity& intensity) {
  EmitterSample sample;
  const Vec3 d = position - reference;
  const float distance_squared = length_squared(d);
  if (!(distance_squared > 0)) return sample;
  sample.distance = std::sqrt(distance_squared);
  sample.wi = d * (1 / sample.distance);
  sample.p = position, sample.n = -sample.wi;
  sample.radiance = intensity(-sample.wi) * (1 / distance_squared);
  sample.pdf_solid_angle = 1;
  sample.is_delta = true;
  return sample;
}

/// Emitter::sample_emission() for such a light. `pdf`: of the direction, per unit solid angle.
inline EmissionSample emit_from_point(const Vec3& position, const Vec3& direction, const Spectrum& intensity,
                                      float pdf) {
  EmissionSample sample;
  sample.ray = {position, direction};
  sample.n = direction;
  sample.radiance = intensity;
  sample.pdf_position = 1;
  sample.pdf_direction = pdf;
  sample.delta_position = true;
  return sample;
}

/// Integral over a texture's unit square by importance sampling of its luminance, so that a few bright texels are not
/// missed: mean of value(position, density), where `value` divides by the density.
template <typename Value>
Spectrum mean_over_texture(const Texture& texture, const Value& value) {
  constexpr int kPoints = 1 << 14;
  double sum[3] = {0, 0, 0};
  for (int i = 0; i < kPoints; ++i) {
    const Vec3 u = lattice_point(i);
    const Texture::PositionSample at = texture.sample_position({u.x, u.y});
    if (!(at.pdf > 0)) continue;
    const Spectrum v = value(at.uv, at.pdf);
    for (int channel = 0; channel < 3; ++channel) sum[channel] += v[channel];
  }
  return {static_cast<float>(sum[0] / kPoints), static_cast<float>(sum[1] / kPoints),
          static_cast<float>(sum[2] / kPoints)};
}

}  // namespace covary
