// SPDX-License-Identifier: Apache-2.0
// Helpers for constructing reflectance models from scene files: colour and number inputs that may be textured, indices
// of refraction by number or name, nested models.
#pragma once

#include <memory>
#include <vector>

#include "scene/bsdf.h"
#include "scene/parameters.h"

namespace covary {

/// A colour parameter; a texture that does not vary is evaluated only once.
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
  /// Null if constant.
  const Texture* texture() const { return texture_.get(); }
  /// The constant value; black if textured.
  const Spectrum& constant() const { return value_; }
  /// Mean over the texture, for lobe probabilities.
  float mean() const { return mean_; }

 private:
  TexturePtr texture_;  // null if constant
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
  /// The constant value; 0 if textured.
  float constant() const { return value_; }

 private:
  TexturePtr texture_;
  float value_ = 0;
};

/// Clamps every channel to [0, 1], for albedos.
inline Spectrum clamp01(const Spectrum& s) { return {clamp01(s.r), clamp01(s.g), clamp01(s.b)}; }

/// Index of refraction `name`: a positive number, or the name of a material, e.g. "water"; `fallback` is such a name.
/// Errors list the known names. Indices are at 0 to 20 degrees Celsius, near 589 nm.
float get_ior(Parameters& parameters, const std::string& name, const std::string& fallback);
/// Relative index int_ior / ext_ior; the defaults are `interior` and air.
float get_relative_ior(Parameters& parameters, const std::string& interior);

/// Complex index of refraction of a conductor from `material`, or from `eta` and `k`; a perfect mirror if neither is
/// given.
struct ConductorInput {
  ColourInput eta, k;
};
ConductorInput get_conductor(Parameters& parameters);

/// The nested models of a wrapper. After an error, empty: if their number is not in [least, most] or one of them could
/// not be created.
std::vector<BsdfPtr> get_nested_bsdfs(Parameters& parameters, size_t least, size_t most);

}  // namespace covary
