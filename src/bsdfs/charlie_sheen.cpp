// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/charlie_sheen.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

#include "core/frame.h"

namespace covary {
namespace {

constexpr float kMinRoughness = 0.07f;
constexpr int kSheenMus = 64, kSheenRoughnesses = 32, kSheenSide = 32;

float sheen_node(int i, int n) { return static_cast<float>(i) / static_cast<float>(n - 1); }

struct Table {
  std::array<float, kSheenMus * kSheenRoughnesses> values;
  Table() {
    for (int r = 0; r < kSheenRoughnesses; ++r) {
      const CharlieSheen sheen(sheen_node(r, kSheenRoughnesses));
      for (int m = 0; m < kSheenMus; ++m) {
        const float mu = std::max(sheen_node(m, kSheenMus), 1e-3f);
        const Vec3 o{safe_sqrt(1 - mu * mu), 0, mu};
        double sum = 0;
        for (int k = 0; k < kSheenSide * kSheenSide; ++k) {  // uniform in angles: the lobe lies near the horizon
          const float theta = (static_cast<float>(k / kSheenSide) + 0.5f) * kPi / 2 / kSheenSide;
          const float phi = (static_cast<float>(k % kSheenSide) + 0.5f) * kPi / kSheenSide;  // half: it is symmetric
          const Vec3 i{std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
          sum += sheen.eval(o, i, normalize(o + i)) * std::sin(theta);
        }
        values[m * kSheenRoughnesses + r] =
            std::min(static_cast<float>(2 * sum * (kPi / 2 / kSheenSide) * (kPi / kSheenSide)), 1.0f);
      }
    }
  }
};

}  // namespace

CharlieSheen::CharlieSheen(float roughness) {
  const float alpha = sqr(std::max(roughness, kMinRoughness)), t = sqr(1 - alpha);
  inverse_alpha_ = 1 / alpha;
  // [EstevezKulla2017] Table 1.
  a_ = lerp(t, 21.5473f, 25.3245f), b_ = lerp(t, 3.82987f, 3.32435f), c_ = lerp(t, 0.19823f, 0.16801f);
  d_ = lerp(t, -1.97760f, -1.27393f), e_ = lerp(t, -4.32054f, -4.85967f);
  half_ = fit(0.5f);
}

float CharlieSheen::lambda(float cosine) const {  // [EstevezKulla2017] Eq. (3)
  return cosine < 0.5f ? std::exp(fit(cosine)) : std::exp(2 * half_ - fit(1 - cosine));
}

float CharlieSheen::eval(const Vec3& o, const Vec3& i, const Vec3& h) const {
  const float sine = safe_sqrt(1 - h.z * h.z);
  const float d = (2 + inverse_alpha_) * std::pow(sine, inverse_alpha_) / kTwoPi;  // [EstevezKulla2017] Eq. (2)
  return d / ((1 + lambda(o.z) + lambda(i.z)) * 4 * std::max(o.z, 1e-4f));
}

float charlie_albedo(float mu, float roughness) {
  static const auto kTable = std::make_unique<const Table>();
  const float x = clamp01(mu) * (kSheenMus - 1), y = clamp01(roughness) * (kSheenRoughnesses - 1);
  const int m = std::min(static_cast<int>(x), kSheenMus - 2), r = std::min(static_cast<int>(y), kSheenRoughnesses - 2);
  const float fx = x - static_cast<float>(m), fy = y - static_cast<float>(r);
  const float* low = &kTable->values[m * kSheenRoughnesses + r];
  return lerp(fx, lerp(fy, low[0], low[1]), lerp(fy, low[kSheenRoughnesses], low[kSheenRoughnesses + 1]));
}

}  // namespace covary
