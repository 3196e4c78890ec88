// SPDX-License-Identifier: Apache-2.0
// Shared checks of BSDFs: each binds a BSDF made from a dictionary at flat_hit() and evaluates it from several
// directions.
//
// Statistical checks: N = 100 000 samples in 64 cells, alpha = 5e-7 for each comparison; they detect, with power 0.99,
// a density wrong by 3.4 % rms, and a total mass wrong by 0.15 % if no sample fails (statistics/chi2.h), and a lobe's
// probability wrong by 1.2 percentage points. The seed is fixed.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "statistics/closure_checks.h"
#include "support/make_bsdf.h"

namespace covary::testing {

using Textures = std::map<std::string, TexturePtr>;

inline const statistics::Chi2Options kModelChi2{.n_samples = 100000, .n_cells = 64};

/// Unit vector at `theta` degrees from the normal; above 90 it lies below the surface.
inline Vec3 direction(float theta, float phi) {
  const float t = theta * kPi / 180;
  return {std::sin(t) * std::cos(phi), std::sin(t) * std::sin(phi), std::cos(t)};
}

/// A BSDF bound at flat_hit() for one outgoing direction.
class Bound {
 public:
  Bound(const Json& dictionary, const Vec3& wo, TransportMode mode = TransportMode::kRadiance, Textures textures = {})
      : bsdf_(make_bsdf(dictionary, std::move(textures))), closure_(bsdf_->bind(flat_hit(), wo.z > 0, mode, arena_)) {}
  Bound(const Bound&) = delete;
  const BsdfClosure* operator->() const { return closure_; }
  const BsdfClosure& operator*() const { return *closure_; }
  const Bsdf& bsdf() const { return *bsdf_; }

 private:
  BsdfPtr bsdf_;
  Arena arena_;
  const BsdfClosure* closure_;
};

/// A closure with a planted bug, which the checks must detect.
class Planted final : public BsdfClosure {
 public:
  enum class Bug {
    kDensity,  ///< all smooth densities 2 % too high
    kReuse,    ///< one random number for both the lobe and the direction
    kPmf,      ///< the probability of lobe 0 understated by 3 %, with weights to match
  };
  Planted(const BsdfClosure& right, Bug bug) : right_(right), bug_(bug) {}

  uint32_t flags() const override { return right_.flags(); }
  BsdfValue eval(const Vec3& wo, const Vec3& wi) const override {
    BsdfValue v = right_.eval(wo, wi);
    v.pdf_solid_angle *= density();
    return v;
  }
  BsdfSample sample(const Vec3& wo, float u_lobe, Vec2 u) const override {
    BsdfSample s = right_.sample(wo, bug_ == Bug::kReuse ? u.x : u_lobe, u);
    const float factor = bug_ == Bug::kPmf && s.lobe == 0 ? 0.97f : s.is_delta() ? 1 : density();
    s.pdf *= factor;
    s.weight *= 1 / factor;
    return s;
  }
  int n_lobes() const override { return right_.n_lobes(); }
  void lobe_pmfs(const Vec3& wo, float* pmfs) const override {
    right_.lobe_pmfs(wo, pmfs);
    if (bug_ != Bug::kPmf) return;
    if (n_lobes() > 1) pmfs[1] += 0.03f * pmfs[0];
    pmfs[0] *= 0.97f;
  }
  void lobe_pdfs(const Vec3& wo, const Vec3& wi, float* pdfs) const override {
    right_.lobe_pdfs(wo, wi, pdfs);
    for (int l = 0; l < n_lobes(); ++l) pdfs[l] *= density();
  }

 private:
  float density() const { return bug_ == Bug::kDensity ? 1.02f : 1; }
  const BsdfClosure& right_;
  Bug bug_;
};

/// All checks of check_closure(), from each of `thetas` (degrees), for radiance and importance.
inline void expect_sound(const Json& dictionary, const std::vector<float>& thetas, const Textures& textures = {}) {
  for (const float theta : thetas) {
    const TransportMode mode = theta < 50 ? TransportMode::kRadiance : TransportMode::kImportance;
    const Vec3 wo = direction(theta, 0.7f);
    const Bound closure(dictionary, wo, mode, textures);
    statistics::Chi2Options options = kModelChi2;
    options.name = dictionary.dump() + " at " + std::to_string(theta) + " degrees";
    EXPECT_EQ(statistics::join(statistics::check_closure(*closure, wo, options)), "");
  }
}

/// The counterpart of expect_sound(): a BSDF with a planted bug is rejected.
inline void expect_rejected(const Json& dictionary, Planted::Bug bug, float theta = 40, const Textures& textures = {}) {
  const Vec3 wo = direction(theta, 0.7f);
  const Bound closure(dictionary, wo, TransportMode::kRadiance, textures);
  EXPECT_NE(statistics::join(statistics::check_closure(Planted(*closure, bug), wo, kModelChi2)), "")
      << dictionary.dump() << ": bug " << static_cast<int>(bug) << " was not found";
}

/// Importance is the adjoint of radiance, f*(wo, wi) = f(wi, wo), for smooth lobes and sampled directions; for BSDFs
/// that ignore the transport mode, this is reciprocity. Returns the number of pairs with a non-zero value.
inline int expect_adjoint(const Json& dictionary, const std::vector<float>& thetas, const Textures& textures = {},
                          float tolerance = 2e-3f) {
  int n_pairs = 0;
  const BsdfPtr bsdf = make_bsdf(dictionary, textures);
  for (const float theta : thetas)
    for (int i = 0; i < 100; ++i) {
      const PathRandom random(Sampling::kIndependent, 5, 0, 0, i);
      const Vec3 wo = direction(theta + 4 * random.get_1d(0, Event::kLens), 6 * random.get_1d(0, Event::kPixel));
      Arena arena;
      const BsdfClosure* radiance = bsdf->bind(flat_hit(), wo.z > 0, TransportMode::kRadiance, arena);
      const BsdfSample s = radiance->sample(wo, random.get_1d(0, Event::kLobe), random.get_2d(0, Event::kDirection));
      if (!s.valid() || s.is_delta() || std::abs(s.wi.z) < 0.02f) continue;
      const BsdfClosure* importance = bsdf->bind(flat_hit(), s.wi.z > 0, TransportMode::kImportance, arena);
      const Spectrum f = radiance->eval(wo, s.wi).value / std::abs(s.wi.z);
      const Spectrum adjoint = importance->eval(s.wi, wo).value / std::abs(wo.z);
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(f[c], adjoint[c], tolerance * std::abs(f[c]) + 1e-6f)
            << dictionary.dump() << " at " << theta << " degrees, sample " << i;
      ++n_pairs;
    }
  return n_pairs;
}

/// The directional albedo of all lobes, the mean weight of N = 100 000 samples, lies in [least, most]. alpha = 5e-7
/// (five standard deviations of the mean); for weights with standard deviation sigma, it detects 7.4 sigma / 316 with
/// power 0.99.
inline void expect_albedo_within(const Json& dictionary, float theta, double least, double most,
                                 TransportMode mode = TransportMode::kRadiance, const Textures& textures = {}) {
  const Vec3 wo = direction(theta, -0.4f);
  const Bound closure(dictionary, wo, mode, textures);
  double variance = 0;
  const double albedo = statistics::sampled_albedo(*closure, wo, 100000, 3, &variance).g;
  const double slack = 5 * std::sqrt(variance) + 1e-5;
  EXPECT_GE(albedo, least - slack) << dictionary.dump() << " at " << theta << " degrees";
  EXPECT_LE(albedo, most + slack) << dictionary.dump() << " at " << theta << " degrees";
}

inline void expect_contains(const std::string& text, const std::string& part) {
  EXPECT_NE(text.find(part), std::string::npos) << "'" << text << "' does not contain '" << part << "'";
}

}  // namespace covary::testing
