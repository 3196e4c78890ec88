// SPDX-License-Identifier: Apache-2.0
// `scale` (Mitsuba 0.x): a texture times a colour.
//
// | parameter | type    | default  | meaning                                        |
// |-----------|---------|----------|------------------------------------------------|
// | (nested)  | texture | required | the texture, under any name                    |
// | scale     | colour  | 1        | factor                                         |
// | maximum   | number  | infinity | larger values, after scaling, are clamped to it |
#include <algorithm>

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

}  // namespace

std::shared_ptr<Texture> make_scale(Parameters& parameters) {
  const Spectrum scale = parameters.get_spectrum("scale", Spectrum(1), SpectrumRole::kEmission);
  const float maximum = parameters.get_float("maximum", kInfinity, 0, kInfinity);
  const auto nested = parameters.children<Texture>("texture");
  if (nested.size() != 1) {
    parameters.error("needs exactly one nested texture, but has " + std::to_string(nested.size()));
    return nullptr;
  }
  return std::make_shared<ScaledTexture>(nested.front(), scale, maximum);
}

}  // namespace covary
