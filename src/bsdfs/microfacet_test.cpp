// SPDX-License-Identifier: Apache-2.0
// Fresnel equations against closed forms and conservation laws; microfacet distributions against their normalisation,
// their masking integral and their sampling of visible normals.
#include "bsdfs/microfacet.h"

#include <gtest/gtest.h>

#include <complex>
#include <numbers>

#include "bsdfs/fresnel.h"
#include "statistics/chi2.h"

namespace covary {
namespace {

using statistics::chi2_sphere;

TEST(Fresnel, DielectricKnownValues) {
  EXPECT_NEAR(fresnel_dielectric(1, 1.5f).reflectance, 0.04f, 1e-7f);
  EXPECT_NEAR(fresnel_dielectric(-1, 1.5f).reflectance, 0.04f, 1e-7f);
  EXPECT_EQ(fresnel_dielectric(0, 1.5f).reflectance, 1);
  EXPECT_EQ(fresnel_dielectric(0.3f, 1).reflectance, 0);
  // Brewster's angle tan(theta) = eta: only the perpendicular component remains, ((1 - eta^2) / (1 + eta^2))^2 / 2.
  EXPECT_NEAR(fresnel_dielectric(1 / std::sqrt(1 + 1.5f * 1.5f), 1.5f).reflectance, 0.5f * sqr(1.25f / 3.25f), 1e-7f);
}

TEST(Fresnel, DielectricIsTheSameFromBothSidesAndObeysSnell) {
  for (const float eta : {0.6f, 1.1f, 1.5f, 2.4f})
    for (int i = 1; i < 100; ++i) {
      const float c = i / 100.0f;
      const DielectricFresnel f = fresnel_dielectric(c, eta);
      EXPECT_EQ(f.eta_it, eta);
      if (f.reflectance == 1) {
        EXPECT_GE(std::sqrt(1 - c * c) / eta, 1 - 1e-5f);  // beyond the critical angle
        EXPECT_EQ(std::abs(f.cos_theta_t), 0);
        continue;
      }
      EXPECT_NEAR(std::sqrt(1 - c * c), eta * std::sqrt(1 - sqr(f.cos_theta_t)), 1e-5f);
      const DielectricFresnel back = fresnel_dielectric(f.cos_theta_t, eta);
      EXPECT_NEAR(back.reflectance, f.reflectance, 1e-4f);
      EXPECT_NEAR(back.cos_theta_t, c, 2e-4f);
      EXPECT_NEAR(back.eta_it * f.eta_it, 1, 1e-6f);
      const Vec3 w{std::sqrt(1 - c * c), 0, c}, t = refract(w, f.cos_theta_t, f.eta_ti);
      EXPECT_NEAR(length(t), 1, 1e-5f);
      const Vec3 m = normalize({0.3f, -0.2f, 0.8f}), o = Frame(m).to_world(w);
      EXPECT_NEAR(length(Frame(m).to_local(refract(o, m, f.cos_theta_t, f.eta_ti)) - t), 0, 1e-5f);
    }
}

TEST(Fresnel, ConductorMatchesComplexArithmetic) {
  using Complex = std::complex<double>;
  for (const Complex index : {Complex(0.2, 3.9), Complex(1.1, 2.4), Complex(1.5, 0), Complex(0, 1)})
    for (int i = 0; i <= 20; ++i) {
      const double c = i / 20.0;
      const Complex t = std::sqrt(index * index - (1 - c * c));  // index times the cosine of the refracted angle
      const double rs = std::norm((c - t) / (c + t));
      const double rp = std::norm((index * index * c - t) / (index * index * c + t));
      EXPECT_NEAR(fresnel_conductor(static_cast<float>(c), index.real(), index.imag()), (rs + rp) / 2, 5e-6)
          << index << " " << c;
    }
  const Spectrum s = fresnel_conductor(0.5f, Spectrum(0.2f, 1.1f, 1.5f), Spectrum(3.9f, 2.4f, 0));
  EXPECT_EQ(s.g, fresnel_conductor(0.5f, 1.1f, 2.4f));
  EXPECT_NEAR(s.b, fresnel_dielectric(0.5f, 1.5f).reflectance, 1e-6f);
}

TEST(Fresnel, DiffuseReflectanceFitsTheIntegral) {
  // 2 integral F(c) c dc by the midpoint rule; the fits are published with errors of 0.1 to 0.2 % for these indices.
  for (const float eta : {1 / 2.0f, 1 / 1.5f, 1 / 1.3f, 1.1f, 1.33f, 1.5f, 2.0f, 3.0f}) {
    double sum = 0;
    constexpr int kSteps = 20000;
    for (int i = 0; i < kSteps; ++i) {
      const double c = (i + 0.5) / kSteps;
      sum += 2 * fresnel_dielectric(static_cast<float>(c), eta).reflectance * c / kSteps;
    }
    EXPECT_NEAR(fresnel_diffuse_reflectance(eta), sum, eta < 1 ? 0.004 : 0.002 * sum) << eta;
  }
}

TEST(Fresnel, SchlickIsExactAtNormalAndGrazingIncidence) {
  const Spectrum r0(0.04f, 0.5f, 0.9f);
  EXPECT_EQ(fresnel_schlick(r0, 1, 1.5f), r0);
  EXPECT_EQ(fresnel_schlick(r0, 0, 1.5f), Spectrum(1));
  EXPECT_EQ(fresnel_schlick(r0, -0.3f, 1.5f), Spectrum(1));  // total internal reflection
  EXPECT_NEAR(schlick_r0(1.5f), 0.04f, 1e-8f);
}

TEST(ErfInv, InvertsErf) {
  for (int i = -999; i < 1000; ++i) {
    const float x = i / 1000.0f;
    EXPECT_NEAR(std::erf(erf_inv(x)), x, 1e-6f);
  }
  EXPECT_NEAR(erf_inv(0.9999f), 2.751064, 1e-3);
}

struct Case {
  MicrofacetType type;
  float alpha_u, alpha_v;
};
const Case kCases[] = {{MicrofacetType::kGgx, 0.5f, 0.5f},        {MicrofacetType::kGgx, 0.02f, 0.02f},
                       {MicrofacetType::kGgx, 0.1f, 0.6f},        {MicrofacetType::kBeckmann, 0.5f, 0.5f},
                       {MicrofacetType::kBeckmann, 0.02f, 0.02f}, {MicrofacetType::kBeckmann, 0.1f, 0.6f}};
Vec3 direction(float theta, float phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

/// Integral over normals, parameterised by tan(theta) = alpha tan(a) so that the integrand is smooth at any roughness.
template <typename F>
double integrate_normals(const Case& c, const F& f) {
  constexpr int kSteps = 500;
  const double alpha = std::sqrt(double(c.alpha_u) * c.alpha_v);
  double sum = 0;
  for (int i = 0; i < kSteps; ++i)
    for (int j = 0; j < kSteps; ++j) {
      const double a = (i + 0.5) / kSteps * std::numbers::pi / 2, phi = (j + 0.5) / kSteps * 2 * std::numbers::pi;
      const double t = alpha * std::tan(a), cos_m = 1 / std::sqrt(1 + t * t);
      const double jacobian = t * cos_m * cos_m * cos_m * alpha / (std::cos(a) * std::cos(a));
      const Vec3 m{float(t * cos_m * std::cos(phi)), float(t * cos_m * std::sin(phi)), float(cos_m)};
      sum += f(m) * jacobian;
    }
  return sum * std::numbers::pi * std::numbers::pi / (double(kSteps) * kSteps);
}

TEST(Microfacet, ProjectedAreaIsOne) {
  for (const Case& c : kCases) {
    const Microfacet d(c.type, c.alpha_u, c.alpha_v);
    EXPECT_NEAR(integrate_normals(c, [&](const Vec3& m) { return double(d.eval(m)) * m.z; }), 1, 2e-4);
  }
}

// The projected area visible from w is cos(theta_w) (Heitz 2014, "Understanding the Masking-Shadowing Function"). This
// determines G1, and is why Beckmann's needs the exact form.
TEST(Microfacet, VisibleAreaIsTheCosine) {
  for (const Case& c : kCases) {
    const Microfacet d(c.type, c.alpha_u, c.alpha_v);
    for (const float theta : {0.1f, 0.9f, 1.5f}) {
      const Vec3 w = direction(theta, 0.6f);
      const double area = integrate_normals(
          c, [&](const Vec3& m) { return double(d.smith_g1(w, m)) * std::max(0.0f, dot(w, m)) * d.eval(m); });
      EXPECT_NEAR(area / w.z, 1, 1e-3) << int(c.type) << " " << c.alpha_u << " " << theta;
      EXPECT_NEAR(d.smith_g1_over_cos(w) * w.z, d.smith_g1(w), 1e-6);
    }
  }
}

TEST(Microfacet, MaskingKnowsSides) {
  const Microfacet d(MicrofacetType::kGgx, 0.3f, 0.3f);
  const Vec3 m = direction(0.2f, 0), up = direction(0.5f, 1), down = direction(2.6f, 1);
  EXPECT_GT(d.smith_g1(up, m), 0);
  EXPECT_GT(d.smith_g1(down, m), 0);
  EXPECT_EQ(d.smith_g1(direction(1.5f, kPi), direction(0.8f, 0)), 0);  // sees the back of the facet
  EXPECT_EQ(d.smith_g(up, direction(1.5f, kPi), direction(0.8f, 0)), 0);
  EXPECT_EQ(d.smith_g1({0, 0, 1}), 1);
}

// N = 100 000 in 64 cells, alpha = 5e-7: detects a density wrong by 3.5 % rms with power 0.99 (statistics/chi2.h).
TEST(Microfacet, SamplesAreVisibleNormals) {
  for (const Case& c : kCases) {
    const Microfacet d(c.type, c.alpha_u, c.alpha_v);
    for (const float theta : {0.0f, 0.7f, 1.3f, 1.55f}) {
      const Vec3 w = direction(theta, 0.6f);
      const auto result = chi2_sphere(
          [&](const PathRandom& random) { return std::optional(d.sample(w, random.get_2d(0, Event::kDirection)).m); },
          [&](const Vec3& m) { return d.pdf(w, m); },
          {.name = "type " + std::to_string(int(c.type)) + " alpha " + std::to_string(c.alpha_u) + " theta " +
                   std::to_string(theta),
           .n_samples = 100000,
           .n_cells = 64});
      EXPECT_TRUE(result.accepted) << result.message;
    }
  }
}

// Planted bugs: sampling a 5 % rougher surface, all normals instead of the visible ones, swapped anisotropy.
TEST(Microfacet, PlantedBugsAreRejected) {
  const Vec3 w = direction(0.9f, 0.6f), up{0, 0, 1};
  const auto rejects = [&](const Microfacet& drawn, const Vec3& w_drawn, const Microfacet& claimed) {
    return !chi2_sphere(
                [&](const PathRandom& r) {
                  return std::optional(drawn.sample(w_drawn, r.get_2d(0, Event::kDirection)).m);
                },
                [&](const Vec3& m) { return claimed.pdf(w, m); },
                {.name = "planted", .n_samples = 100000, .n_cells = 64})
                .accepted;
  };
  for (const MicrofacetType type : {MicrofacetType::kGgx, MicrofacetType::kBeckmann}) {
    EXPECT_TRUE(rejects({type, 0.21f, 0.21f}, w, {type, 0.2f, 0.2f}));
    EXPECT_TRUE(rejects({type, 0.2f, 0.2f}, up, {type, 0.2f, 0.2f}));
    EXPECT_TRUE(rejects({type, 0.2f, 0.3f}, w, {type, 0.3f, 0.2f}));
    EXPECT_FALSE(rejects({type, 0.2f, 0.3f}, w, {type, 0.2f, 0.3f}));
  }
}

TEST(Microfacet, SamplesAreContinuousInTheNumbers) {
  for (const Case& c : kCases) {
    const Microfacet d(c.type, c.alpha_u, c.alpha_v);
    const Vec3 w = direction(0.9f, 0.6f);
    for (int i = 0; i < 400; ++i) {
      const int column = i % 20, row = i / 20;
      const Vec2 u{(column + 0.5f) / 20, (row + 0.5f) / 20}, v{u.x + 1e-4f, u.y - 1e-4f};
      EXPECT_LT(length(d.sample(w, u).m - d.sample(w, v).m), 1e-2f) << u.x << " " << u.y;
    }
    EXPECT_LT(length(d.sample(w, {0, 0.4f}).m - d.sample(w, {kOneMinusEpsilon, 0.4f}).m),
              c.type == MicrofacetType::kGgx ? 1e-4f : 2.1f);  // the cap is periodic in u.x
  }
}

}  // namespace
}  // namespace covary
