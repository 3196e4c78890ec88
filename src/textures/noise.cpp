// SPDX-License-Identifier: Apache-2.0
// `noise`: patterns in space made of Perlin's noise, pbrt's textures `fbm`, `wrinkled`, `windy` and `marble`. All
// octaves are added wherever the surface is; pbrt leaves out those that are finer than its pixels.
//
// | parameter | type      | default  | meaning                                                               |
// |-----------|-----------|----------|-----------------------------------------------------------------------|
// | pattern   | string    | fbm      | or `wrinkled`, `windy`, `marble` (coloured)                           |
// | octaves   | integer   | 8        | number of octaves, except for `windy`                                 |
// | roughness | float     | 0.5      | weight of an octave relative to the one before                        |
// | scale     | float     | 1        | `marble`: factor on the position                                      |
// | variation | float     | 0.2      | `marble`: how much noise bends the stripes                            |
// | to_world  | transform | identity | from the pattern's space                                              |
//
// `dots`: a disk of radius 0.35 in about every second unit square of texture coordinates, as in pbrt.
//
// | parameter       | type            | default  | meaning                                        |
// |-----------------|-----------------|----------|------------------------------------------------|
// | inside, outside | colour, texture | 1, 0     | of the dots, and between them                  |
// | to_uv           | transform       | identity | from surface parameters to texture coordinates |
#include <algorithm>
#include <cmath>

#include "core/perlin_noise.h"
#include "textures/gradient.h"
#include "textures/registry.h"
#include "textures/uv_transform.h"

namespace covary {
namespace {

enum class Pattern { kFbm, kWrinkled, kWindy, kMarble };

/// pbrt's colours of marble (textures.cpp): a chain of cubic Bezier curves of overlapping control points.
Spectrum marble(float t) {
  static constexpr float kColours[9][3] = {{.58f, .58f, .6f}, {.58f, .58f, .6f}, {.58f, .58f, .6f},
                                           {.5f, .5f, .5f},   {.6f, .59f, .58f}, {.58f, .58f, .6f},
                                           {.58f, .58f, .6f}, {.2f, .2f, .33f},  {.58f, .58f, .6f}};
  constexpr int kSegments = 6;
  const int first = std::clamp(static_cast<int>(t * kSegments), 0, kSegments - 1);
  const float x = t * kSegments - static_cast<float>(first), y = 1 - x;
  const float weights[4] = {y * y * y, 3 * x * y * y, 3 * x * x * y, x * x * x};
  Spectrum sum;
  for (int i = 0; i < 4; ++i) {
    const float* c = kColours[first + i];
    sum = sum + Spectrum(c[0], c[1], c[2]) * (1.5f * weights[i]);
  }
  return sum;
}

class Noise final : public Texture {
 public:
  explicit Noise(Parameters& p)
      : octaves_(p.get_int("octaves", 8, 0, 100)),
        roughness_(p.get_float("roughness", 0.5f, 0, 1)),
        scale_(p.get_float("scale", 1)),
        variation_(p.get_float("variation", 0.2f)),
        to_pattern_(p.get_transform("to_world").inverse()) {
    const std::string name = p.get_choice("pattern", "fbm", {"fbm", "wrinkled", "windy", "marble"});
    pattern_ = name == "fbm"        ? Pattern::kFbm
               : name == "wrinkled" ? Pattern::kWrinkled
               : name == "windy"    ? Pattern::kWindy
                                    : Pattern::kMarble;
  }
  Spectrum eval(const SurfaceHit& hit) const override {
    if (pattern_ != Pattern::kMarble) return Spectrum(number(to_pattern_.point(hit.p)));
    const Vec3 p = to_pattern_.point(hit.p) * scale_;
    return marble(0.5f + 0.5f * std::sin(p.y + variation_ * fractal_noise(p, roughness_, octaves_)));
  }
  float eval_1(const SurfaceHit& hit) const override {
    return pattern_ == Pattern::kMarble ? luminance(eval(hit)) : number(to_pattern_.point(hit.p));
  }
  Vec2 grad_1(const SurfaceHit& hit) const override { return difference_gradient(*this, hit); }
  float mean() const override { return 0.5f; }

 private:
  float number(const Vec3& p) const {
    if (pattern_ == Pattern::kFbm) return fractal_noise(p, roughness_, octaves_);
    if (pattern_ == Pattern::kWrinkled) return turbulence(p, roughness_, octaves_);
    return std::abs(fractal_noise(p * 0.1f, 0.5f, 3)) * fractal_noise(p, 0.5f, 6);
  }

  Pattern pattern_;
  int octaves_;
  float roughness_, scale_, variation_;
  Transform to_pattern_;
};

class Dots final : public Texture {
 public:
  Dots(TexturePtr inside, TexturePtr outside, const UvTransform& to_uv)
      : inside_(std::move(inside)), outside_(std::move(outside)), to_uv_(to_uv) {}
  Spectrum eval(const SurfaceHit& hit) const override { return at(hit).eval(hit); }
  float eval_1(const SurfaceHit& hit) const override { return at(hit).eval_1(hit); }
  Vec2 grad_1(const SurfaceHit& hit) const override { return at(hit).grad_1(hit); }
  float mean() const override {
    constexpr float kCovered = 0.5f * kPi * 0.35f * 0.35f;
    return lerp(kCovered, outside_->mean(), inside_->mean());
  }

 private:
  const Texture& at(const SurfaceHit& hit) const {
    constexpr float kRadius = 0.35f, kShift = 0.5f - kRadius;
    const Vec2 st = to_uv_.apply(hit.uv);
    const float s = std::floor(st.x + 0.5f), t = std::floor(st.y + 0.5f);
    const auto noise = [&](float ds, float dt) { return perlin_noise({s + ds, t + dt, 0.5f}); };
    if (!(noise(0.5f, 0.5f) > 0)) return *outside_;
    const Vec2 d = {st.x - (s + kShift * noise(1.5f, 2.8f)), st.y - (t + kShift * noise(4.5f, 9.8f))};
    return dot(d, d) < kRadius * kRadius ? *inside_ : *outside_;
  }

  TexturePtr inside_, outside_;
  UvTransform to_uv_;
};

}  // namespace

std::shared_ptr<Texture> make_noise(Parameters& p) { return std::make_shared<Noise>(p); }

std::shared_ptr<Texture> make_dots(Parameters& p) {
  TexturePtr inside = p.get_texture("inside", Spectrum(1), SpectrumRole::kEmission),
             outside = p.get_texture("outside", Spectrum(0), SpectrumRole::kEmission);
  if (!inside || !outside) return nullptr;  // reported
  return std::make_shared<Dots>(std::move(inside), std::move(outside), UvTransform(p.get_transform("to_uv")));
}

}  // namespace covary
