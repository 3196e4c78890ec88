// SPDX-License-Identifier: Apache-2.0
// Discrete and PiecewiseConstant2D: frequencies and positions follow the weights, empty cells are never sampled,
// remapped numbers stay uniform, invalid weights are rejected.
#include "core/distribution.h"

#include <gtest/gtest.h>

#include <cmath>

#include "core/error.h"
#include "statistics/chi2.h"

namespace covary {
namespace {

using statistics::chi2_discrete;
using statistics::Chi2Result;

std::vector<float> random_weights(int n, uint64_t seed, bool with_zeros) {
  std::vector<float> weights(n);
  for (int i = 0; i < n; ++i) {
    const Vec2 u = PathRandom(Sampling::kIndependent, seed, 0, i, 0).get_2d(0, Event::kPixel);
    weights[i] = with_zeros && u.x < 0.3f ? 0 : u.y * u.y * 10 + 1e-3f;
  }
  return weights;
}

float number(int i) { return PathRandom(Sampling::kIndependent, 17, 0, 0, i).get_1d(0, Event::kLightChoice); }

std::string message_of(const std::vector<float>& weights) {
  try {
    Discrete{weights};
  } catch (const Error& error) {
    EXPECT_EQ(error.code(), ErrorCode::kInput);
    return error.what();
  }
  return "";
}

TEST(Discrete, SmallExample) {
  const std::vector<float> weights{1, 0, 2, 1};
  const Discrete d(weights);
  EXPECT_EQ(d.size(), 4u);
  EXPECT_EQ(d.sum(), 4);
  EXPECT_EQ(d.pmf(0), 0.25f);
  EXPECT_EQ(d.pmf(1), 0);
  EXPECT_EQ(d.pmf(2), 0.5f);
  const Discrete::Result r = d.sample(0.5f);
  EXPECT_EQ(r.index, 2u);
  EXPECT_EQ(r.pmf, 0.5f);
  EXPECT_EQ(r.remapped, 0.5f);
  EXPECT_EQ(d.sample(0.25f).index, 2u);  // the boundary belongs to the next non-empty cell
  EXPECT_EQ(d.sample(0.25f).remapped, 0);
}

TEST(Discrete, NeverDrawsEmptyCells) {
  for (const std::vector<float>& weights :
       {std::vector<float>{0, 0, 3, 0}, {0, 1, 0}, {1, 0, 0}, {0, 0, 1e-30f}, {1e30f, 0, 1e30f, 0}, {5}}) {
    const Discrete d(weights);
    for (const float u : {0.0f, 0x1p-24f, 0.25f, 0.5f, 0.99999f, kOneMinusEpsilon}) {
      const Discrete::Result r = d.sample(u);
      ASSERT_LT(r.index, weights.size());
      EXPECT_GT(weights[r.index], 0);
      EXPECT_GT(r.pmf, 0);
      EXPECT_GE(r.remapped, 0);
      EXPECT_LT(r.remapped, 1);
    }
  }
}

TEST(Discrete, SampleReturnsWhatPmfSaysAndStretchesTheNumber) {
  for (const int n : {1, 2, 3, 17, 1000, 100000}) {
    const std::vector<float> weights = random_weights(n, 5, n > 2);
    const Discrete d(weights);
    std::vector<double> lower(n + 1);
    for (int i = 0; i < n; ++i) lower[i + 1] = lower[i] + d.pmf(i);
    EXPECT_NEAR(lower[n], 1, 1e-6);
    for (int i = 0; i < 2000; ++i) {
      const float u = number(i);
      const Discrete::Result r = d.sample(u);
      EXPECT_EQ(r.pmf, d.pmf(r.index));
      EXPECT_NEAR(lower[r.index] + r.remapped * double(r.pmf), u, 2e-6);
      EXPECT_NEAR(r.pmf, weights[r.index] / d.sum(), 1e-6);
    }
  }
}

// N = 300 000, alpha = 5e-7. Detects 1.8 % rms with power 0.99 for 17 cells, 3.5 % for 1000. Planted bug: weights
// alternately raised and lowered by 10 %.
TEST(Discrete, FrequenciesAreTheWeights) {
  for (const int n : {2, 17, 1000})
    for (const bool planted : {false, true}) {
      const std::vector<float> weights = random_weights(n, 6, n > 2);
      std::vector<float> drawn = weights;
      if (planted)
        for (int i = 0; i < n; ++i) drawn[i] *= i % 2 ? 1.1f : 0.9f;
      const Discrete d(drawn), claimed(weights);
      std::vector<double> observed(n), probabilities(n);
      for (int i = 0; i < 300000; ++i) ++observed[d.sample(number(i)).index];
      for (int i = 0; i < n; ++i) probabilities[i] = weights[i] / claimed.sum();
      const Chi2Result result = chi2_discrete(observed, probabilities, {.name = "discrete"});
      EXPECT_EQ(result.accepted, !planted) << result.message;
    }
}

// The remapped number is uniform and independent of the index. N = 200 000 in 128 cells, alpha = 5e-7: detects 2.8 %
// rms with power 0.99. Planted bug: the number itself is returned.
TEST(Discrete, RemappedNumberIsIndependentOfTheIndex) {
  const std::vector<float> weights{1, 3, 0, 0.5f, 2};
  const Discrete d(weights);
  for (const bool planted : {false, true}) {
    const Chi2Result result = statistics::chi2_square(
        [&](const PathRandom& random) {
          const float u = random.get_1d(0, Event::kLightChoice);
          const Discrete::Result r = d.sample(u);
          // Each index is a strip, filled by a second number.
          return std::optional(Vec2{(r.index + random.get_1d(1, Event::kLobe)) / 5, planted ? u : r.remapped});
        },
        [&](const Vec2& p) { return 5 * d.pmf(std::min(4, int(p.x * 5))); }, {.name = "remapped", .n_samples = 200000});
    EXPECT_EQ(result.accepted, !planted) << result.message;
  }
}

TEST(Discrete, RefusesWrongWeights) {
  EXPECT_EQ(message_of({}), "a distribution needs at least one weight");
  EXPECT_EQ(message_of({0, 0}), "all weights of a distribution are zero");
  EXPECT_EQ(message_of({1, -2}), "weight 1 of a distribution is -2.000000, not a finite number >= 0");
  EXPECT_EQ(message_of({NAN}), "weight 0 of a distribution is nan, not a finite number >= 0");
  EXPECT_EQ(message_of({1, INFINITY}), "weight 1 of a distribution is inf, not a finite number >= 0");
}

struct Size {
  int width, height;
};

std::vector<float> random_grid(const Size& size) {
  std::vector<float> weights = random_weights(size.width * size.height, 8, true);
  for (int y = 1; y < size.height; y += 3)  // whole rows are empty
    for (int x = 0; x < size.width; ++x) weights[y * size.width + x] = 0;
  weights[0] = 1;
  return weights;
}

TEST(PiecewiseConstant2D, DensityIsTheWeights) {
  for (const Size size : {Size{1, 1}, {1, 7}, {7, 1}, {5, 3}, {33, 17}, {64, 32}}) {
    const std::vector<float> weights = random_grid(size);
    const PiecewiseConstant2D d(weights, size.width, size.height);
    EXPECT_EQ(d.width(), size.width);
    EXPECT_EQ(d.height(), size.height);
    double sum = 0, mass = 0;
    for (const float w : weights) sum += w;
    const double n = double(size.width) * size.height;
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        const float pdf = d.pdf({(x + 0.5f) / size.width, (y + 0.5f) / size.height});
        EXPECT_NEAR(pdf, weights[y * size.width + x] / sum * n, 1e-6 * n + 1e-5 * pdf);
        mass += pdf / n;
      }
    EXPECT_NEAR(mass, 1, 1e-5);
    for (int i = 0; i < 2000; ++i) {
      const PiecewiseConstant2D::Result r = d.sample({number(i), number(i + 5000)});
      ASSERT_TRUE(r.uv.x >= 0 && r.uv.x < 1 && r.uv.y >= 0 && r.uv.y < 1);
      EXPECT_EQ(r.pdf, d.pdf(r.uv)) << r.uv.x << " " << r.uv.y << " in " << size.width << " x " << size.height;
      EXPECT_GT(r.pdf, 0);
    }
    // Numbers at cell boundaries, where rounding could move the point into the next cell.
    for (int x = 0; x < size.width; ++x)
      for (const float at : {0.0f, -0x1p-24f, 0x1p-24f}) {
        const float u = std::clamp(float(x) / size.width + at, 0.0f, kOneMinusEpsilon);
        const PiecewiseConstant2D::Result r = d.sample({u, u});
        EXPECT_EQ(r.pdf, d.pdf(r.uv)) << u << " in " << size.width << " x " << size.height;
        EXPECT_GT(r.pdf, 0);
      }
  }
}

TEST(PiecewiseConstant2D, RoundingKeepsPointsInTheirCells) {
  // Every second cell is empty; the numbers include the last float of a cell.
  constexpr int kWidth = 4097;
  std::vector<float> weights(kWidth);
  for (int i = 0; i < kWidth; i += 2) weights[i] = 1;
  const PiecewiseConstant2D d(weights, kWidth, 1);
  for (int i = 0; i < 2000000; ++i) {
    const PiecewiseConstant2D::Result r = d.sample({number(i), 0});
    ASSERT_GT(d.pdf(r.uv), 0) << number(i);
  }
}

// N = 200 000, alpha = 5e-7; 5 x 3 cells: detects 1.9 % rms with power 0.99, 33 x 17: 4 %. Planted bug: width and
// height of the grid swapped, as if rows were columns.
TEST(PiecewiseConstant2D, SamplesFollowTheGrid) {
  for (const Size size : {Size{1, 7}, {7, 1}, {5, 3}, {33, 17}})
    for (const bool planted : {false, true}) {
      const std::vector<float> weights = random_grid(size);
      const PiecewiseConstant2D d(weights, size.width, size.height);
      const PiecewiseConstant2D drawn = planted ? PiecewiseConstant2D(weights, size.height, size.width) : d;
      std::vector<double> observed(weights.size()), probabilities(weights.size());
      for (int i = 0; i < 200000; ++i) {
        const Vec2 uv =
            drawn.sample(PathRandom(Sampling::kIndependent, 2, 0, 0, i).get_2d(0, Event::kLightPosition)).uv;
        ++observed[int(uv.y * size.height) * size.width + int(uv.x * size.width)];
      }
      double sum = 0;
      for (const float w : weights) sum += w;
      for (size_t i = 0; i < weights.size(); ++i) probabilities[i] = weights[i] / sum;
      const Chi2Result result = chi2_discrete(observed, probabilities, {.name = "grid " + std::to_string(size.width)});
      EXPECT_EQ(result.accepted, !planted) << result.message;
    }
}

// N = 200 000 in 128 cells, alpha = 5e-7: detects 2.8 % rms with power 0.99. Planted bugs: density * 1.02; one number
// for both coordinates.
TEST(PiecewiseConstant2D, SamplesFollowTheDensityWithinCells) {
  const std::vector<float> weights{1, 4, 0, 0, 0, 0, 2, 0, 3};
  const PiecewiseConstant2D d(weights, 3, 3);
  const auto test = [&](float factor, bool reuse) {
    return statistics::chi2_square(
        [&](const PathRandom& random) {
          const Vec2 u = random.get_2d(0, Event::kLightPosition);
          return std::optional(d.sample(reuse ? Vec2{u.x, u.x} : u).uv);
        },
        [&](const Vec2& uv) { return factor * d.pdf(uv); }, {.name = "grid 3 x 3", .n_samples = 200000});
  };
  const Chi2Result right = test(1, false);
  EXPECT_TRUE(right.accepted) << right.message;
  EXPECT_FALSE(test(1.02f, false).accepted);
  EXPECT_FALSE(test(1, true).accepted);
}

TEST(PiecewiseConstant2D, RefusesWrongGrids) {
  const std::vector<float> weights{1, 2, 3}, zeros{0, 0, 0, 0}, nan{1, NAN};
  const auto message = [](const std::vector<float>& w, int width, int height) -> std::string {
    try {
      PiecewiseConstant2D(w, width, height);
    } catch (const Error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(message(weights, 2, 2).find("grid size does not match the number of weights"), std::string::npos);
  EXPECT_NE(message(weights, -1, -3).find("grid size does not match the number of weights"), std::string::npos);
  EXPECT_EQ(message(zeros, 2, 2), "all weights of a distribution are zero");
  EXPECT_NE(message(nan, 2, 1).find("not a finite number >= 0"), std::string::npos) << message(nan, 2, 1);
  EXPECT_NE(message({1, -3}, 2, 1).find("not a finite number >= 0"), std::string::npos);
}

}  // namespace
}  // namespace covary
