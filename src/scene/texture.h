// SPDX-License-Identifier: Apache-2.0
// Textures: functions on surfaces, with RGB or single-channel values.
#pragma once

#include <memory>

#include "scene/object.h"
#include "scene/surface_hit.h"

namespace covary {

class Texture : public SceneObject {
 public:
  /// Linear RGB value at the point. Not clamped: models clamp reflectances themselves if necessary.
  virtual Spectrum eval(const SurfaceHit& hit) const = 0;
  /// Single-channel value: the luminance of a colour texture, the first channel of a raw or grey one.
  virtual float eval_1(const SurfaceHit& hit) const = 0;
  /// Derivatives of eval_1 with respect to the surface parameters (u, v), for bump maps.
  virtual Vec2 grad_1(const SurfaceHit& hit) const = 0;
  /// Prefetches what eval() will read at these surface parameters. Does not change results.
  virtual void prefetch(Vec2 /*uv*/) const {}
  /// True if eval does not depend on the point.
  virtual bool is_constant() const { return false; }
  /// Mean of eval_1 over the texture, used for lobe sampling probabilities (not for values).
  virtual float mean() const = 0;

  /// Aspect ratio (width over height) of the image as projected; 1 if it has no pixels.
  virtual float aspect() const { return 1; }

  struct PositionSample {
    Vec2 uv;
    float pdf;  ///< per unit area of the (u, v) unit square
  };
  /// Samples a point of the (u, v) unit square with density roughly proportional to luminance; uniform by default.
  virtual PositionSample sample_position(Vec2 u) const { return {u, 1}; }
  virtual float pdf_position(Vec2 /*uv*/) const { return 1; }
};

using TexturePtr = std::shared_ptr<const Texture>;

/// The same value everywhere.
class ConstantTexture final : public Texture {
 public:
  explicit ConstantTexture(const Spectrum& value)
      : value_(value), grey_(value.r == value.g && value.g == value.b ? value.r : luminance(value)) {}
  Spectrum eval(const SurfaceHit&) const override { return value_; }
  float eval_1(const SurfaceHit&) const override { return grey_; }
  Vec2 grad_1(const SurfaceHit&) const override { return {}; }
  bool is_constant() const override { return true; }
  float mean() const override { return covary::mean(value_); }

 private:
  Spectrum value_;
  float grey_;
};

}  // namespace covary
