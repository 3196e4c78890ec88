// SPDX-License-Identifier: Apache-2.0
// Every warp: points follow the density (chi-square), |det J| times density is 1 (finite differences), and planted bugs
// are rejected.
#include "core/warp.h"

#include <gtest/gtest.h>

#include "statistics/chi2.h"

namespace covary {
namespace {

using statistics::chi2_sphere;
using statistics::chi2_square;
using statistics::Chi2Result;

// N = 200 000 in 128 cells, alpha = 5e-7: detects a density wrong by 2.8 % rms with power 0.99.
statistics::Chi2Options options(const std::string& name) { return {.name = name, .n_samples = 200000}; }

Vec2 numbers(const PathRandom& random) { return random.get_2d(0, Event::kDirection); }

Chi2Result test_disk(float pdf_factor, bool forget_radius) {
  return chi2_square(
      [&](const PathRandom& r) {
        Vec2 p = warp::square_to_disk(numbers(r));
        if (forget_radius) p = p * std::sqrt(dot(p, p));
        return std::optional(Vec2{(p.x + 1) / 2, (p.y + 1) / 2});
      },
      [&](const Vec2& s) {
        const Vec2 p{2 * s.x - 1, 2 * s.y - 1};
        return dot(p, p) < 1 ? 4 * pdf_factor * kInvPi : 0;  // 4: the square [-1, 1]^2 has that area
      },
      options("disk"));
}
TEST(Warp, Disk) {
  const Chi2Result right = test_disk(1, false);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(test_disk(1.02f, false).accepted);
  EXPECT_FALSE(test_disk(1, true).accepted);
  EXPECT_EQ(warp::square_to_disk({0.5f, 0.5f}), Vec2{});
}

TEST(Warp, CosineHemisphere) {
  const auto test = [](auto pdf) {
    return chi2_sphere([](const PathRandom& r) { return std::optional(warp::square_to_cosine_hemisphere(numbers(r))); },
                       pdf, options("cosine hemisphere"));
  };
  const Chi2Result right = test([](const Vec3& w) { return warp::cosine_hemisphere_pdf_solid_angle(w.z); });
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(test([](const Vec3& w) { return 1.02f * warp::cosine_hemisphere_pdf_solid_angle(w.z); }).accepted);
  EXPECT_FALSE(test([](const Vec3& w) { return w.z > 0 ? kInvPi / 2 : 0; }).accepted);  // dropped cosine
}

TEST(Warp, Sphere) {
  const auto test = [](float factor, bool squeeze) {
    return chi2_sphere(
        [&](const PathRandom& r) {
          const Vec3 w = warp::square_to_sphere(numbers(r));
          return std::optional(squeeze ? normalize({w.x, w.y, 0.95f * w.z}) : w);
        },
        [&](const Vec3&) { return factor * warp::sphere_pdf_solid_angle(); }, options("sphere"));
  };
  const Chi2Result right = test(1, false);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(test(1.02f, false).accepted);
  EXPECT_FALSE(test(1, true).accepted);
}

TEST(Warp, Cone) {
  // From the sun's disk (1.1e-5) to the whole sphere (2).
  for (const float one_minus_cos_max : {1e-7f, 1.1e-5f, 0.1f, 1.0f, 1.7f, 2.0f}) {
    const auto test = [&](float factor, float widen) {
      return chi2_sphere(
          [&](const PathRandom& r) {
            return std::optional(warp::square_to_cone(numbers(r), widen * one_minus_cos_max));
          },
          [&](const Vec3& w) {
            const float one_minus_cos = w.z > 0 ? (w.x * w.x + w.y * w.y) / (1 + w.z) : 1 - w.z;
            return one_minus_cos < one_minus_cos_max ? factor * warp::cone_pdf_solid_angle(one_minus_cos_max) : 0;
          },
          options("cone " + std::to_string(one_minus_cos_max)));
    };
    const Chi2Result right = test(1, 1);
    EXPECT_TRUE(right.accepted) << right.message;
    EXPECT_FALSE(test(1.02f, 1).accepted) << one_minus_cos_max;
    EXPECT_FALSE(test(1, 0.97f).accepted) << one_minus_cos_max;
    for (int i = 0; i < 100; ++i)
      EXPECT_NEAR(length(warp::square_to_cone({i / 100.0f, i % 10 / 10.0f}, one_minus_cos_max)), 1, 1e-6f);
  }
}

TEST(Warp, Triangle) {
  const auto test = [](float factor, bool folded) {
    return chi2_square(
        [&](const PathRandom& r) {
          const Vec2 u = numbers(r);
          return std::optional(folded ? Vec2{u.x, u.y * (1 - u.x)} : warp::square_to_triangle(u));
        },
        [&](const Vec2& b) { return b.x + b.y < 1 ? 2 * factor : 0.0f; }, options("triangle"));
  };
  const Chi2Result right = test(1, false);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(test(1.02f, false).accepted);
  EXPECT_FALSE(test(1, true).accepted);  // forgotten square root
}

TEST(Warp, Tent) {
  for (const float radius : {0.5f, 1.0f, 2.5f}) {
    const auto test = [&](float factor, bool uniform) {
      return chi2_square(
          [&](const PathRandom& r) {
            const Vec2 u = numbers(r);
            const float x = uniform ? radius * (2 * u.x - 1) : warp::interval_to_tent(u.x, radius);
            return std::optional(Vec2{(x / radius + 1) / 2, u.y});
          },
          [&](const Vec2& s) { return factor * 2 * (1 - std::abs(2 * s.x - 1)); }, options("tent"));
    };
    const Chi2Result right = test(1, false);
    EXPECT_TRUE(right.accepted) << right.message;
    EXPECT_FALSE(test(1.02f, false).accepted);
    EXPECT_FALSE(test(1, true).accepted);
    EXPECT_EQ(warp::interval_to_tent(0, radius), -radius);
    EXPECT_NEAR(warp::interval_to_tent(0.5f, radius), 0, 1e-6f);
  }
}

// Area of the image of a small square around u over the square's area: the reciprocal of the density. Central
// differences with step 1/256 are exact to about 1e-4 away from the kinks of the concentric map.
template <typename Map>
double jacobian(const Map& map, Vec2 u) {
  constexpr float kStep = 0x1p-8f;
  const Vec3 dx = (map({u.x + kStep, u.y}) - map({u.x - kStep, u.y})) / (2 * kStep);
  const Vec3 dy = (map({u.x, u.y + kStep}) - map({u.x, u.y - kStep})) / (2 * kStep);
  return length(cross(dx, dy));
}

TEST(Warp, JacobianTimesDensityIsOne) {
  for (const Vec2 u : {Vec2{0.3f, 0.42f}, Vec2{0.77f, 0.6f}, Vec2{0.1f, 0.35f}, Vec2{0.52f, 0.93f}}) {
    const auto flat = [](auto map) {
      return [map](Vec2 v) {
        const Vec2 p = map(v);
        return Vec3{p.x, p.y, 0};
      };
    };
    EXPECT_NEAR(jacobian(flat(warp::square_to_disk), u) * kInvPi, 1, 1e-3);
    EXPECT_NEAR(jacobian(flat(warp::square_to_triangle), u) * 2, 1, 1e-3);
    EXPECT_NEAR(jacobian(warp::square_to_sphere, u) * warp::sphere_pdf_solid_angle(), 1, 1e-3);
    const float z = warp::square_to_cosine_hemisphere(u).z;
    EXPECT_NEAR(jacobian(warp::square_to_cosine_hemisphere, u) * warp::cosine_hemisphere_pdf_solid_angle(z), 1, 2e-3);
    for (const float c : {0.01f, 0.5f, 1.5f})
      EXPECT_NEAR(jacobian([&](Vec2 v) { return warp::square_to_cone(v, c); }, u) * warp::cone_pdf_solid_angle(c), 1,
                  2e-3);
    const float x = warp::interval_to_tent(u.x, 2);
    const float slope = (warp::interval_to_tent(u.x + 0x1p-8f, 2) - warp::interval_to_tent(u.x - 0x1p-8f, 2)) * 0x1p7f;
    EXPECT_NEAR(slope * (1 - std::abs(x) / 2) / 2, 1, 1e-3);
  }
}

TEST(Warp, DensitiesVanishOutside) {
  EXPECT_EQ(warp::cosine_hemisphere_pdf_solid_angle(-0.1f), 0);
  EXPECT_EQ(warp::cosine_hemisphere_pdf_solid_angle(0), 0);
}

}  // namespace
}  // namespace covary
