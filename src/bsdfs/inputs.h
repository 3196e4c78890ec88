// SPDX-License-Identifier: Apache-2.0
// What reflectance models share when they are made from a scene file: colour and number inputs that may be textured,
// indices of refraction by number or name, nested models.
#pragma once

#include <memory>
#include <vector>

#include "scene/bsdf.h"
#include "scene/parameters.h"

namespace covary {

/// A colour parameter, looked up once when it does not depend on the point.
class ColourInput {
 public:
  ColourInput(Parameters& parameters, const std::string& name, float fallback)
      : ColourInput(parameters.get_texture(name, Spectrum(fallback))) {}
  explicit ColourInput(TexturePtr texture) : texture_(std::move(texture)) {
    mean_ = texture_->mean();
    if (texture_->is_constant()) value_ = texture_->eval(SurfaceHit{}), texture_ = nullptr;
  }
  bool is_constant() const { return !texture_; }
  Spectrum eval(const SurfaceHit& hit) const { return texture_ ? texture_->eval(hit) : value_; }
  /// Null when constant.
  const Texture* texture() const { return texture_.get(); }
  /// The value everywhere; black when not constant.
  const Spectrum& constant() const { return value_; }
  /// Mean over the texture, for the probabilities of lobes.
  float mean() const { return mean_; }

 private:
  TexturePtr texture_;  // null when constant
  Spectrum value_;
  float mean_;
};

/// The same for a number.
class NumberInput {
 public:
  explicit NumberInput(TexturePtr texture) : texture_(std::move(texture)) {
    if (texture_->is_constant()) value_ = texture_->eval_1(SurfaceHit{}), texture_ = nullptr;
  }
  bool is_constant() const { return !texture_; }
  float eval(const SurfaceHit& hit) const { return texture_ ? texture_->eval_1(hit) : value_; }
  /// The value everywhere; 0 when not constant.
  float constant() const { return value_; }

 private:
  TexturePtr texture_;
  float value_ = 0;
};

/// Every channel limited to [0, 1], for albedos.
inline Spectrum clamp01(const Spectrum& s) { return {clamp01(s.r), clamp01(s.g), clamp01(s.b)}; }

/// Index of refraction `name`: a positive number, or the name of a material, e.g. "water"; `fallback` is such a name.
/// Error lists the known names. Indices at 0 to 20 degrees Celsius near 589 nm.
float get_ior(Parameters& parameters, const std::string& name, const std::string& fallback);
/// Relative index int_ior / ext_ior, with `interior` and air as defaults.
float get_relative_ior(Parameters& parameters, const std::string& interior);

/// Complex index of refraction of a conductor from `material`, or `eta` and `k`, or a perfect mirror when none is
/// given.
struct ConductorInput {
  ColourInput eta, k;
};
ConductorInput get_conductor(Parameters& parameters);

/// The nested models of a wrapper. Empty after an error when their number is not in [least, most] or one of them could
/// not be made.
std::vector<BsdfPtr> get_nested_bsdfs(Parameters& parameters, size_t least, size_t most);

}  // namespace covary
