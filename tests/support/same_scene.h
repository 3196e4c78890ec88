// SPDX-License-Identifier: Apache-2.0
// Compares two scenes without statistics: camera rays, hits, reflection and light.
#pragma once

#include <gtest/gtest.h>

#include "core/arena.h"
#include "io/load_scene.h"

namespace covary::test_support {

inline double difference(const Vec3& a, const Vec3& b) { return length(a - b); }

/// Both scenes have the same hits and BSDF values along a grid of camera rays, and lights of the same power.
inline void expect_same_scene(const LoadedScene& a, const LoadedScene& b, int min_hits) {
  ASSERT_EQ(a.width, b.width);
  ASSERT_EQ(a.height, b.height);
  EXPECT_EQ(a.crop_width, b.crop_width);
  EXPECT_EQ(a.spp, b.spp);
  EXPECT_EQ(a.integrator_type, b.integrator_type);
  EXPECT_EQ(a.filter.kind, b.filter.kind);
  constexpr int kSide = 24;
  int hits = 0;
  Arena arena;
  for (int i = 0; i < kSide * kSide; ++i) {
    const Vec2 film{(static_cast<float>(i % kSide) + 0.4f) / kSide * static_cast<float>(a.width),
                    (static_cast<float>(i / kSide) + 0.6f) / kSide * static_cast<float>(a.height)};
    const Ray ra = a.scene->camera().ray(film, {0.3f, 0.4f}), rb = b.scene->camera().ray(film, {0.3f, 0.4f});
    ASSERT_LT(difference(ra.d, rb.d), 1e-5) << i;
    SurfaceHit ha, hb;
    const bool hit = a.scene->intersect(ra, ha);
    ASSERT_EQ(hit, b.scene->intersect(rb, hb)) << i;
    if (!hit) continue;
    ++hits;
    ASSERT_LT(difference(ha.p, hb.p), 1e-4) << i;
    EXPECT_LT(difference(ha.ng, hb.ng), 1e-4) << i;
    EXPECT_LT(difference(ha.frame.n, hb.frame.n), 1e-4) << i;
    EXPECT_EQ(ha.shape->emitter() != nullptr, hb.shape->emitter() != nullptr) << i;
    const Vec3 wo = ha.frame.to_local(-ra.d), wi = normalize(Vec3{0.3f, -0.5f, wo.z > 0 ? 1.0f : -1.0f});
    arena.reset();
    const auto value = [&](const SurfaceHit& h) {
      return h.shape->bsdf()->bind(h, wo.z > 0, TransportMode::kRadiance, arena)->eval(wo, wi).value;
    };
    const Spectrum va = value(ha), vb = value(hb);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(va[c], vb[c], 1e-3f * std::abs(vb[c]) + 1e-5f) << i;
  }
  EXPECT_GE(hits, min_hits);
  ASSERT_EQ(a.scene->emitters().size(), b.scene->emitters().size());
  for (size_t i = 0; i < a.scene->emitters().size(); ++i)
    for (int c = 0; c < 3; ++c)
      EXPECT_NEAR(a.scene->emitters()[i]->power()[c], b.scene->emitters()[i]->power()[c],
                  1e-4f * b.scene->emitters()[i]->power()[c]);
}

}  // namespace covary::test_support
