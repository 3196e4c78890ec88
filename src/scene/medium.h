// SPDX-License-Identifier: Apache-2.0
// Participating media.
#pragma once

#include <algorithm>
#include <memory>
#include <utility>

#include "scene/volume.h"

namespace covary {

/// Phase function. Its density equals its value: phase functions are sampled exactly.
class PhaseFunction : public SceneObject {
 public:
  /// Per unit solid angle, for a path arriving along `d` and continuing along `w`; both are unit vectors.
  virtual float pdf(const Vec3& d, const Vec3& w) const = 0;
  /// Samples w.
  virtual Vec3 sample(const Vec3& d, Vec2 u) const = 0;
};

using PhasePtr = std::shared_ptr<const PhaseFunction>;

/// What a medium is made of.
struct MediumSettings {
  VolumePtr extinction;  ///< per unit length, before `scale`
  VolumePtr albedo;      ///< single-scattering albedo, in [0, 1]
  VolumePtr radiance;    ///< of a piece so thick that it is opaque, without scattering; null: emits no light
  PhasePtr phase;
  float scale = 1;          ///< factor on the extinction
  bool homogeneous = true;  ///< constant extinction, without bounds
  bool sample_lights = true;
};

class Medium final : public SceneObject {
 public:
  struct Coefficients {
    Spectrum extinction, scattering;  ///< per unit length
  };

  explicit Medium(MediumSettings settings)
      : settings_(std::move(settings)),
        majorant_(settings_.extinction->largest() * settings_.scale),
        bounds_(settings_.extinction->bounds()) {}

  Coefficients at(const Vec3& p) const {
    const Spectrum extinction = settings_.homogeneous ? majorant_ : settings_.extinction->eval(p) * settings_.scale;
    return {extinction, extinction * settings_.albedo->eval(p)};
  }
  /// Whether it glows.
  bool emits() const { return settings_.radiance != nullptr; }
  /// Radiance emitted per unit length at a point with these coefficients: what it absorbs times what it glows by.
  Spectrum emission(const Vec3& p, const Coefficients& here) const {
    return (here.extinction - here.scattering) * settings_.radiance->eval(p);
  }
  /// Upper bound on the extinction.
  const Spectrum& majorant() const { return majorant_; }
  /// Whether the extinction equals majorant() everywhere.
  bool homogeneous() const { return settings_.homogeneous; }
  const PhaseFunction& phase() const { return *settings_.phase; }
  /// Whether light is sampled at scattering points; otherwise only scattered directions find it.
  bool sample_lights() const { return settings_.sample_lights; }

  /// Clips [near, far] of the ray to the medium; false if nothing is left.
  bool clip(const Ray& ray, float& near, float& far) const {
    if (settings_.homogeneous) return near < far;
    for (int axis = 0; axis < 3; ++axis) {
      const float o = ray.o[axis], d = ray.d[axis], low = bounds_.lower[axis], high = bounds_.upper[axis];
      if (d == 0) {
        if (o < low || o > high) return false;
        continue;
      }
      const float a = (low - o) / d, b = (high - o) / d;
      near = std::max(near, std::min(a, b));
      far = std::min(far, std::max(a, b));
    }
    return near < far;
  }

 private:
  MediumSettings settings_;
  Spectrum majorant_;
  Bounds3 bounds_;
};

using MediumPtr = std::shared_ptr<const Medium>;

}  // namespace covary
