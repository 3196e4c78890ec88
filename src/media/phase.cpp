// SPDX-License-Identifier: Apache-2.0
// isotropic: uniform over the sphere. No parameters.
//
// rayleigh: scattering by particles much smaller than the wavelength (Strutt 1871). No parameters.
//
// hg: forward or backward scattering [HenyeyGreenstein1941].
//
// | name | type  | default | meaning                                                                      |
// |------|-------|---------|------------------------------------------------------------------------------|
// | g    | float | 0.8     | mean cosine of the angle by which light turns, in (-1, 1); forwards where positive |
#include <algorithm>
#include <cmath>

#include "core/frame.h"
#include "core/trigonometry.h"
#include "core/warp.h"
#include "media/registry.h"

namespace covary {
namespace {

class Isotropic final : public PhaseFunction {
 public:
  float pdf(const Vec3&, const Vec3&) const override { return warp::sphere_pdf_solid_angle(); }
  Vec3 sample(const Vec3&, Vec2 u) const override { return warp::square_to_sphere(u); }
};

class Rayleigh final : public PhaseFunction {
 public:
  float pdf(const Vec3& d, const Vec3& w) const override { return 3 / (16 * kPi) * (1 + sqr(dot(d, w))); }
  Vec3 sample(const Vec3& d, Vec2 u) const override {
    // The CDF is a cubic polynomial in the cosine, inverted by Cardano's formula.
    const double z = 4.0 * u.x - 2, root = std::sqrt(z * z + 1);
    const float cosine = std::clamp(static_cast<float>(std::cbrt(z + root) + std::cbrt(z - root)), -1.0f, 1.0f);
    const float r = safe_sqrt(1 - cosine * cosine);
    const SinCos phi = sincos_turns(u.y);
    return Frame(d).to_world({r * phi.cos, r * phi.sin, cosine});
  }
};

class HenyeyGreenstein final : public PhaseFunction {
 public:
  explicit HenyeyGreenstein(float g) : g_(g) {}

  float pdf(const Vec3& d, const Vec3& w) const override {
    // [HenyeyGreenstein1941] (1 - g²) / (4π (1 + g² - 2 g cos)^1.5), with the base written as a sum of non-negative
    // terms.
    const float base = g_ >= 0 ? sqr(1 - g_) + g_ * length_squared(d - w) : sqr(1 + g_) - g_ * length_squared(d + w);
    return (1 - g_ * g_) / (4 * kPi * base * std::sqrt(base));
  }
  Vec3 sample(const Vec3& d, Vec2 u) const override {
    const float z = cosine(u.x);
    const float r = safe_sqrt(1 - z * z);
    const SinCos phi = sincos_turns(u.y);
    return Frame(d).to_world({r * phi.cos, r * phi.sin, z});
  }

 private:
  /// Inverse CDF.
  float cosine(float u) const {
    if (std::abs(g_) < 1e-3f) {  // first-order series in g, where the closed form divides by g
      const float z = 1 - 2 * u;
      return std::clamp(z + 1.5f * g_ * (1 - z * z), -1.0f, 1.0f);
    }
    const float s = (1 - g_ * g_) / (1 + g_ - 2 * g_ * u);
    return std::clamp((1 + g_ * g_ - s * s) / (2 * g_), -1.0f, 1.0f);
  }
  float g_;
};

}  // namespace

PhasePtr isotropic_phase() { return std::make_shared<Isotropic>(); }
std::shared_ptr<PhaseFunction> make_isotropic(Parameters&) { return std::make_shared<Isotropic>(); }
std::shared_ptr<PhaseFunction> make_rayleigh(Parameters&) { return std::make_shared<Rayleigh>(); }

std::shared_ptr<PhaseFunction> make_hg(Parameters& p) {
  constexpr float kLargest = 0.9999f;  // beyond it, floats cannot resolve the forward directions
  return std::make_shared<HenyeyGreenstein>(p.get_float("g", 0.8f, -kLargest, kLargest));
}

}  // namespace covary
