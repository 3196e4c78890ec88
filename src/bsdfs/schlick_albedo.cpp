// SPDX-License-Identifier: Apache-2.0
#include "bsdfs/schlick_albedo.h"

#include <algorithm>
#include <array>
#include <memory>

#include "bsdfs/fresnel.h"
#include "bsdfs/microfacet.h"
#include "core/warp.h"

namespace covary {
namespace {

constexpr int kMus = 64, kRoughnesses = 32, kSide = 24;  // points of the tables; kSide^2 directions for each

float node(int i, int n) { return std::max(static_cast<float>(i) / static_cast<float>(n - 1), 1e-3f); }

Vec3 seen_under(float mu) { return {safe_sqrt(1 - mu * mu), 0, mu}; }

/// The mean of contribution(u) = (1 - w, w) times a weight, over points u of a grid.
template <typename Contribution>
SchlickAlbedo mean_of(const Contribution& contribution) {
  SchlickAlbedo sum{0, 0};
  for (int k = 0; k < kSide * kSide; ++k) {
    const Vec2 u{(static_cast<float>(k % kSide) + 0.5f) / kSide, (static_cast<float>(k / kSide) + 0.5f) / kSide};
    const SchlickAlbedo one = contribution(u);
    sum.at_f0 += one.at_f0, sum.at_f90 += one.at_f90;
  }
  return {sum.at_f0 / (kSide * kSide), sum.at_f90 / (kSide * kSide)};
}

struct Tables {
  std::array<SchlickAlbedo, kMus> diffuse;
  std::array<SchlickAlbedo, kMus * kRoughnesses> specular;

  Tables() {
    for (int m = 0; m < kMus; ++m) {
      const Vec3 o = seen_under(node(m, kMus));
      diffuse[m] = mean_of([&](Vec2 u) {
        const Vec3 i = warp::square_to_cosine_hemisphere(u);
        const float w = schlick_weight(dot(o, normalize(o + i)));
        return SchlickAlbedo{1 - w, w};
      });
      for (int r = 0; r < kRoughnesses; ++r) {
        const float alpha = sqr(node(r, kRoughnesses));
        const Microfacet distribution(MicrofacetType::kGgx, alpha, alpha);
        specular[m * kRoughnesses + r] = mean_of([&](Vec2 u) {  // the density has the masking of o
          const Vec3 h = distribution.sample(o, u).m, i = reflect(o, h);
          const float w = schlick_weight(dot(o, h)), g = i.z > 0 ? distribution.smith_g1(i) : 0;
          return SchlickAlbedo{g * (1 - w), g * w};
        });
      }
    }
  }
};

const Tables& tables() {
  static const auto kTables = std::make_unique<const Tables>();
  return *kTables;
}

struct Cell {
  int i;
  float f;
};
Cell cell_of(float x, int n) {
  const float at = clamp01(x) * static_cast<float>(n - 1);
  const int i = std::min(static_cast<int>(at), n - 2);
  return {i, at - static_cast<float>(i)};
}

SchlickAlbedo mix(float f, const SchlickAlbedo& a, const SchlickAlbedo& b) {
  return {lerp(f, a.at_f0, b.at_f0), lerp(f, a.at_f90, b.at_f90)};
}

}  // namespace

SchlickAlbedo schlick_specular_albedo(float mu, float roughness) {
  const Cell m = cell_of(mu, kMus), r = cell_of(roughness, kRoughnesses);
  const SchlickAlbedo* low = &tables().specular[m.i * kRoughnesses + r.i];
  const SchlickAlbedo* high = low + kRoughnesses;
  return mix(m.f, mix(r.f, low[0], low[1]), mix(r.f, high[0], high[1]));
}

SchlickAlbedo schlick_diffuse_albedo(float mu) {
  const Cell m = cell_of(mu, kMus);
  return mix(m.f, tables().diffuse[m.i], tables().diffuse[m.i + 1]);
}

}  // namespace covary
