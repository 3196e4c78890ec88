// SPDX-License-Identifier: Apache-2.0
#include "tensors/warp_table.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "core/random.h"
#include "support/files.h"

namespace covary {
namespace {

using test_support::message_of;

/// Two nodes of the first parameter, three of the second; values include empty rows, columns and corners.
const ParameterNodes kNodes{{-1, 1}, {0, 1, 3}};
constexpr GridSize kSize{4, 3};

std::vector<float> values() {
  std::vector<float> v;
  for (uint32_t slice = 0; slice < kNodes.n_slices(); ++slice)
    for (int y = 0; y < kSize.height; ++y)
      for (int x = 0; x < kSize.width; ++x)
        v.push_back(x == 0 || (y == 2 && slice == 0) ? 0 : 1.0f + std::sin(static_cast<float>(slice * 7 + y * 3 + x)));
  return v;
}
const WarpTable& table() {
  static const WarpTable made(values(), kSize, "t");
  return made;
}
const SliceMix kMixes[] = {kNodes.at(-1, 0), kNodes.at(0.2f, 0.7f), kNodes.at(9, 9), kNodes.at(0.9f, 2.9f)};

TEST(ParameterNodes, WeightsAreLinearBetweenNodesAndLimitedBeyond) {
  const SliceMix inside = kNodes.at(0, 2);
  ASSERT_EQ(inside.n, 4);
  const std::array<uint32_t, 4> slices{1, 2, 4, 5};
  for (size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(inside.slice[i], slices[i]);
    EXPECT_FLOAT_EQ(inside.weight[i], 0.25f);
  }
  const SliceMix beyond = kNodes.at(-7, 70);
  ASSERT_EQ(beyond.n, 1);
  EXPECT_EQ(beyond.slice[0], 2u);
  EXPECT_EQ(beyond.weight[0], 1);
  const SliceMix single = ParameterNodes{{2}, {0, 1}}.at(-3, 0.25f);
  ASSERT_EQ(single.n, 2);
  EXPECT_FLOAT_EQ(single.weight[0], 0.75f);
}

TEST(BilinearTable, InterpolatesAndLimits) {
  const BilinearTable<float> t({1, 2, 3, 4, 5, 6, 7, 8}, {2, 2});
  EXPECT_FLOAT_EQ(t.eval(0, {0.5f, 0}), 1.5f);
  EXPECT_FLOAT_EQ(t.eval(0, {0, 0.5f}), 2);
  EXPECT_FLOAT_EQ(t.eval(1, {2, 2}), 8);
  EXPECT_FLOAT_EQ(t.eval(ParameterNodes{{0}, {0, 1}}.at(0, 0.5f), {0.5f, 0.5f}), 4.5f);
}

/// Midpoint rule over 400 x 400 cells; for a function bilinear on a grid of thirds and halves the error is 2e-5.
TEST(WarpTable, DensityIntegratesToOne) {
  for (const SliceMix& mix : kMixes) {
    double sum = 0;
    constexpr int kN = 400;
    for (int y = 0; y < kN; ++y)
      for (int x = 0; x < kN; ++x)
        sum += table().pdf(mix, Vec2{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f} * (1.0f / kN));
    EXPECT_NEAR(sum / (kN * kN), 1, 1e-4);
  }
}

TEST(WarpTable, InverseUndoesSampling) {
  for (const SliceMix& mix : kMixes)
    for (int i = 0; i < 2000; ++i) {
      const Vec2 u = PathRandom(Sampling::kIndependent, 3, 0, 0, i).get_2d(0, Event::kDirection);
      const WarpTable::Result there = table().sample(mix, u);
      ASSERT_GT(there.pdf, 0);
      EXPECT_NEAR(there.pdf, table().pdf(mix, there.uv), 1e-3f);
      const WarpTable::Result back = table().invert(mix, there.uv);
      EXPECT_NEAR(back.uv.x, u.x, 1e-4f);
      EXPECT_NEAR(back.uv.y, u.y, 1e-4f);
      EXPECT_NEAR(back.pdf, there.pdf, 1e-3f);
    }
}

/// The Jacobian determinant of the map is one over the density: deterministic. Finite differences of 1e-3 in floats are
/// 1 % off, and more at cell edges, which a second difference of 2e-3 detects and excludes.
TEST(WarpTable, SamplesFollowTheDensity) {
  int n = 0;
  for (const SliceMix& mix : kMixes)
    for (int i = 0; i < 500; ++i) {
      const Vec2 u = PathRandom(Sampling::kIndependent, 5, 0, 0, i).get_2d(0, Event::kDirection);
      constexpr float kStep = 1e-3f;
      if (u.x < kStep || u.y < kStep || u.x > 1 - kStep || u.y > 1 - kStep) continue;
      const auto at = [&](float dx, float dy) { return table().sample(mix, {u.x + dx, u.y + dy}).uv; };
      const Vec2 dx = (at(kStep, 0) - at(-kStep, 0)) * (0.5f / kStep);
      const Vec2 dy = (at(0, kStep) - at(0, -kStep)) * (0.5f / kStep);
      const Vec2 twice = (at(2 * kStep, 0) - at(-2 * kStep, 0)) * (0.25f / kStep);
      const float area = std::abs(dx.x * dy.y - dx.y * dy.x), pdf = table().sample(mix, u).pdf;
      if (pdf < 0.2f || std::abs(twice.x - dx.x) > 0.01f * std::abs(dx.x)) continue;
      EXPECT_NEAR(area * pdf, 1, 0.03f) << u.x << " " << u.y;
      ++n;
    }
  EXPECT_GT(n, 1000);
}

TEST(WarpTable, EdgesOfTheSquareAreSampled) {
  for (const SliceMix& mix : kMixes)
    for (const Vec2 u : {Vec2{0, 0}, Vec2{kOneMinusEpsilon, kOneMinusEpsilon}, Vec2{0, kOneMinusEpsilon}}) {
      const Vec2 uv = table().sample(mix, u).uv;
      EXPECT_TRUE(uv.x >= 0 && uv.x <= 1 && uv.y >= 0 && uv.y <= 1) << uv.x << " " << uv.y;
    }
}

TEST(WarpTable, WrongValuesAreNamed) {
  const auto of = [](const std::vector<float>& v) {
    return message_of([&] { const WarpTable made(v, {2, 2}, "vndf"); }, ErrorCode::kInput);
  };
  EXPECT_EQ(of({1, 1, 1, 1, 1, 1, -0.5f, 1}), "'vndf' has the negative value -0.5 in slice 1; it is a density");
  std::vector<float> black(8, 1.0f);
  std::fill(black.begin() + 4, black.end(), 0.0f);
  EXPECT_EQ(of(black), "'vndf' is zero everywhere in slice 1; it is a density");
}

}  // namespace
}  // namespace covary
