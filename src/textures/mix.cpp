// SPDX-License-Identifier: Apache-2.0
// `mix`: between two textures, as in pbrt; by the angle of the normal with `direction`, pbrt's `directionmix`.
//
// | parameter | type            | default | meaning                                                               |
// |-----------|-----------------|---------|-----------------------------------------------------------------------|
// | first     | colour, texture | 0       | where `amount` is 0                                                   |
// | second    | colour, texture | 1       | where `amount` is 1; values between are interpolated in each channel  |
// | amount    | colour, texture | 0.5     | values outside [0, 1] extrapolate, but never below 0                  |
// | direction | vector          | none    | instead of `amount`: its absolute product with the unit normal        |
//
// `bilerp`: between four colours at the corners of the square of texture coordinates, as in pbrt.
//
// | parameter          | type      | default    | meaning                                        |
// |--------------------|-----------|------------|------------------------------------------------|
// | v00, v01, v10, v11 | colour    | 0, 1, 0, 1 | at (0, 0), (0, 1), (1, 0), (1, 1)              |
// | to_uv              | transform | identity   | from surface parameters to texture coordinates |
// | repeat             | boolean   | false      | begin again at each integer coordinate         |
#include <algorithm>
#include <cmath>

#include "textures/gradient.h"
#include "textures/registry.h"
#include "textures/uv_transform.h"

namespace covary {
namespace {

class Mix final : public Texture {
 public:
  Mix(TexturePtr first, TexturePtr second, TexturePtr amount, const Vec3& direction)
      : first_(std::move(first)), second_(std::move(second)), amount_(std::move(amount)), direction_(direction) {}

  Spectrum eval(const SurfaceHit& hit) const override {
    const Spectrum a = first_->eval(hit), b = second_->eval(hit), t = amount(hit);
    const Spectrum mixed = a + (b - a) * t;
    return {std::max(mixed.r, 0.0f), std::max(mixed.g, 0.0f), std::max(mixed.b, 0.0f)};
  }
  float eval_1(const SurfaceHit& hit) const override {
    const float t = amount_ ? amount_->eval_1(hit) : std::abs(dot(hit.frame.n, direction_));
    return std::max(lerp(t, first_->eval_1(hit), second_->eval_1(hit)), 0.0f);
  }
  Vec2 grad_1(const SurfaceHit& hit) const override {
    const Vec2 a = first_->grad_1(hit), b = second_->grad_1(hit);
    const float t = amount_ ? amount_->eval_1(hit) : std::abs(dot(hit.frame.n, direction_));
    const Vec2 mixed = a * (1 - t) + b * t;
    return amount_ ? mixed + amount_->grad_1(hit) * (second_->eval_1(hit) - first_->eval_1(hit)) : mixed;
  }
  bool is_constant() const override {
    return first_->is_constant() && second_->is_constant() && amount_ && amount_->is_constant();
  }
  float mean() const override {
    return std::max(lerp(amount_ ? amount_->mean() : 0.5f, first_->mean(), second_->mean()), 0.0f);
  }

 private:
  Spectrum amount(const SurfaceHit& hit) const {
    return amount_ ? amount_->eval(hit) : Spectrum(std::abs(dot(hit.frame.n, direction_)));
  }

  TexturePtr first_, second_, amount_;  // amount: null if by direction
  Vec3 direction_;
};

class Bilerp final : public Texture {
 public:
  explicit Bilerp(Parameters& p) : to_uv_(p.get_transform("to_uv")), repeat_(p.get_bool("repeat", false)) {
    constexpr const char* kNames[] = {"v00", "v10", "v01", "v11"};
    for (size_t i = 0; i < 4; ++i)
      corners_[i] = p.get_spectrum(kNames[i], Spectrum(i < 2 ? 0.0f : 1.0f), SpectrumRole::kEmission);
  }
  Spectrum eval(const SurfaceHit& hit) const override {
    const Spectrum value = at(place(hit));
    return {std::max(value.r, 0.0f), std::max(value.g, 0.0f), std::max(value.b, 0.0f)};
  }
  float eval_1(const SurfaceHit& hit) const override { return luminance(eval(hit)); }
  Vec2 grad_1(const SurfaceHit& hit) const override {
    const Vec2 st = place(hit);
    const auto step = [&](float s, float t) { return luminance(at({st.x + s, st.y + t})) - luminance(at(st)); };
    return to_uv_.chain({step(1, 0), step(0, 1)});  // exact: linear in each
  }
  float mean() const override { return covary::mean(at({0.5f, 0.5f})); }

 private:
  Vec2 place(const SurfaceHit& hit) const {
    const Vec2 st = to_uv_.apply(hit.uv);
    return repeat_ ? Vec2{st.x - std::floor(st.x), st.y - std::floor(st.y)} : st;
  }
  Spectrum at(Vec2 st) const {
    return lerp(st.y, lerp(st.x, corners_[0], corners_[1]), lerp(st.x, corners_[2], corners_[3]));
  }

  Spectrum corners_[4];
  UvTransform to_uv_;
  bool repeat_;
};

}  // namespace

std::shared_ptr<Texture> make_mix(Parameters& p) {
  TexturePtr first = p.get_texture("first", Spectrum(0), SpectrumRole::kEmission),
             second = p.get_texture("second", Spectrum(1), SpectrumRole::kEmission), amount;
  const Vec3 direction = p.get_vec3("direction", {0, 0, 0});
  if (!p.has("direction")) amount = p.get_texture("amount", Spectrum(0.5f), SpectrumRole::kEmission);
  if (!first || !second || (!amount && !p.has("direction"))) return nullptr;  // reported
  if (!p.has("direction")) return std::make_shared<Mix>(first, second, amount, direction);
  if (length(direction) > 0) return std::make_shared<Mix>(first, second, nullptr, normalize(direction));
  p.error_at("direction", "has length zero");
  return nullptr;
}

std::shared_ptr<Texture> make_bilerp(Parameters& p) { return std::make_shared<Bilerp>(p); }

}  // namespace covary
