// SPDX-License-Identifier: Apache-2.0
// `scale` (Mitsuba 0.x): a texture times a colour or another texture.
//
// | parameter | type            | default  | meaning                                         |
// |-----------|-----------------|----------|-------------------------------------------------|
// | (nested)  | texture         | required | the texture, under any name                     |
// | scale     | colour, texture | 1        | factor                                          |
// | maximum   | number          | infinity | larger values, after scaling, are clamped to it |
// | exponent  | number          | 1        | at last, values are raised to this power        |
#include <algorithm>
#include <cmath>

#include "textures/registry.h"

namespace covary {
namespace {

class ScaledTexture final : public Texture {
 public:
  ScaledTexture(TexturePtr nested, const Spectrum& scale, float maximum)
      : nested_(std::move(nested)), scale_(scale), maximum_(maximum), grey_(scale.r == scale.g && scale.g == scale.b) {}

  Spectrum eval(const SurfaceHit& hit) const override {
    const Spectrum s = nested_->eval(hit) * scale_;
    return {std::min(s.r, maximum_), std::min(s.g, maximum_), std::min(s.b, maximum_)};
  }
  float eval_1(const SurfaceHit& hit) const override {
    return grey_ ? std::min(nested_->eval_1(hit) * scale_.r, maximum_) : luminance(eval(hit));
  }
  /// For a coloured factor: gradient of the nested luminance times the luminance of the factor, since bump maps are not
  /// colours.
  Vec2 grad_1(const SurfaceHit& hit) const override {
    return nested_->eval_1(hit) * factor() > maximum_ ? Vec2{0, 0} : nested_->grad_1(hit) * factor();
  }
  bool is_constant() const override { return nested_->is_constant(); }
  float mean() const override { return std::min(nested_->mean() * factor(), maximum_); }
  PositionSample sample_position(Vec2 u) const override { return nested_->sample_position(u); }
  float pdf_position(Vec2 uv) const override { return nested_->pdf_position(uv); }

 private:
  float factor() const { return grey_ ? scale_.r : luminance(scale_); }

  TexturePtr nested_;
  Spectrum scale_;
  float maximum_;
  bool grey_;
};

class Product final : public Texture {
 public:
  Product(TexturePtr first, TexturePtr second, float maximum)
      : first_(std::move(first)), second_(std::move(second)), maximum_(maximum) {}
  Spectrum eval(const SurfaceHit& hit) const override {
    const Spectrum s = first_->eval(hit) * second_->eval(hit);
    return {std::min(s.r, maximum_), std::min(s.g, maximum_), std::min(s.b, maximum_)};
  }
  float eval_1(const SurfaceHit& hit) const override {
    return std::min(first_->eval_1(hit) * second_->eval_1(hit), maximum_);
  }
  Vec2 grad_1(const SurfaceHit& hit) const override {
    return first_->grad_1(hit) * second_->eval_1(hit) + second_->grad_1(hit) * first_->eval_1(hit);
  }
  float mean() const override { return std::min(first_->mean() * second_->mean(), maximum_); }

 private:
  TexturePtr first_, second_;
  float maximum_;
};

/// The square root of a roughness, for example.
class Power final : public Texture {
 public:
  Power(TexturePtr base, float exponent) : base_(std::move(base)), exponent_(exponent) {}
  Spectrum eval(const SurfaceHit& hit) const override {
    const Spectrum s = base_->eval(hit);
    return {power(s.r), power(s.g), power(s.b)};
  }
  float eval_1(const SurfaceHit& hit) const override { return power(base_->eval_1(hit)); }
  Vec2 grad_1(const SurfaceHit& hit) const override {
    const float value = base_->eval_1(hit);
    return value > 0 ? base_->grad_1(hit) * (exponent_ * power(value) / value) : Vec2{0, 0};
  }
  bool is_constant() const override { return base_->is_constant(); }
  float mean() const override { return power(base_->mean()); }

 private:
  float power(float x) const { return std::pow(std::max(x, 0.0f), exponent_); }

  TexturePtr base_;
  float exponent_;
};

}  // namespace

std::shared_ptr<Texture> make_scale(Parameters& parameters) {
  const TexturePtr factor = parameters.get_texture("scale", Spectrum(1), SpectrumRole::kEmission);
  const float maximum = parameters.get_float("maximum", kInfinity, 0, kInfinity);
  const float exponent = parameters.get_float("exponent", 1, 0, 100);
  const auto nested = parameters.children<Texture>("texture");
  const bool reported = std::any_of(
      parameters.object().properties.begin(), parameters.object().properties.end(), [](const Property& property) {
        const ObjectPtr* object = std::get_if<ObjectPtr>(&property.value);
        return object && property.name != "scale" && (!*object || (*object)->kind == "texture");
      });
  if (nested.empty() && reported) return nullptr;
  if (nested.size() != 1) {
    parameters.error("needs exactly one nested texture, but has " + std::to_string(nested.size()));
    return nullptr;
  }
  std::shared_ptr<Texture> scaled;
  if (factor->is_constant())
    scaled = std::make_shared<ScaledTexture>(nested.front(), factor->eval(SurfaceHit{}), maximum);
  else
    scaled = std::make_shared<Product>(nested.front(), factor, maximum);
  return exponent == 1 ? scaled : std::make_shared<Power>(scaled, exponent);
}

}  // namespace covary
