// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_solver.h"

#include <gtest/gtest.h>

#include "core/random.h"
#include "sampling/system_sums.h"

namespace covary {
namespace {

struct Coefficients {
  std::vector<Spectrum> lights, dense;
};
Coefficients solved(decltype(solve_dense)* solve, const SystemView& system, Coefficients prior,
                    const SolveSettings& settings = {}) {
  solve(system, settings, {prior.lights, prior.dense});
  return prior;
}
Coefficients fast(const SystemView& system, const Coefficients& prior, const SolveSettings& settings = {}) {
  return solved(solve_block_arrow, system, prior, settings);
}
Coefficients slow(const SystemView& system, const Coefficients& prior, const SolveSettings& settings = {}) {
  return solved(solve_dense, system, prior, settings);
}

/// Sums of one cell, and its system.
struct OneCell {
  explicit OneCell(uint32_t n_dense) : sums(SystemLayout{n_dense}) { cell = sums.cell({}); }
  void add(float weight, Spectrum value, uint32_t light, float r_light, std::span<const float> r_dense) {
    sums.add(cell, weight, {value, light, r_light, r_dense});
  }
  /// Lights must have been added in increasing order, so that the rows are sorted.
  SystemView view() {
    lights.clear(), rows.clear();
    for (size_t i = 0; i < sums.n_rows(); ++i) {
      lights.push_back(sums.row_light(i));
      rows.insert(rows.end(), sums.row(i).begin(), sums.row(i).end());
    }
    return {sums.layout(), sums.head(cell), lights, rows};
  }
  Coefficients zeros() const {
    return {std::vector<Spectrum>(sums.n_rows()), std::vector<Spectrum>(sums.layout().n_dense)};
  }
  SystemSums sums;
  uint32_t cell;
  std::vector<uint32_t> lights;
  std::vector<float> rows;
};

/// Deterministic numbers in [0, 1).
class Numbers {
 public:
  float next() { return PathRandom(Sampling::kIndependent, 7, 0, 0, n_++).get_1d(1, Event::kLobe); }

 private:
  uint64_t n_ = 0;
};

void fill_randomly(OneCell& cell, Numbers& numbers, uint32_t n_lights, uint32_t samples_of_each) {
  const uint32_t m = cell.sums.layout().n_dense;
  std::vector<float> r(m);
  for (uint32_t light = 0; light < n_lights; ++light)
    for (uint32_t s = 0; s < samples_of_each; ++s) {
      float total = 0, own = numbers.next();
      for (float& x : r) total += x = numbers.next();
      total += own;
      for (float& x : r) x /= total;
      const float weight = std::exp2(8 * numbers.next() - 4);
      cell.add(weight, {numbers.next(), 3 * numbers.next(), numbers.next() - 0.5f}, light, own / total, r);
    }
}

float largest_difference(const Coefficients& a, const Coefficients& b) {
  float largest = 0;
  const auto add = [&](const Spectrum& x, const Spectrum& y) {
    for (int c = 0; c < 3; ++c)
      largest = std::max(largest, std::abs(x[c] - y[c]) / (1 + std::abs(x[c]) + std::abs(y[c])));
  };
  for (size_t i = 0; i < a.lights.size(); ++i) add(a.lights[i], b.lights[i]);
  for (size_t i = 0; i < a.dense.size(); ++i) add(a.dense[i], b.dense[i]);
  return largest;
}

TEST(CoefficientSolver, BlockArrowEqualsDenseOnRandomSystems) {
  Numbers numbers;
  for (const uint32_t m : {0u, 1u, 2u, 3u, 7u, 20u})
    for (const uint32_t n_lights : {1u, 2u, 30u})
      for (const double weight : {0.0, 4.0}) {
        OneCell cell(m);
        fill_randomly(cell, numbers, n_lights, 12);
        Coefficients prior = cell.zeros();
        for (Spectrum& value : prior.lights) value = Spectrum(numbers.next());
        for (Spectrum& value : prior.dense) value = Spectrum(numbers.next());
        for (const bool monochrome : {false, true}) {
          const SolveSettings settings{weight, monochrome};
          const Coefficients arrow = fast(cell.view(), prior, settings);
          EXPECT_LT(largest_difference(arrow, slow(cell.view(), prior, settings)), 2e-6f)
              << m << " dense, " << n_lights << " lights, weight of the prior " << weight;
        }
      }
}

// Separate weights per channel give the same as three systems, each with the weights of one channel.
TEST(CoefficientSolver, ChannelsWithWeightsOfTheirOwnAreSystemsOfTheirOwn) {
  Numbers numbers;
  for (const uint32_t m : {1u, 2u}) {
    SystemSums all(SystemLayout{m, true});
    const uint32_t cell = all.cell({});
    std::vector<OneCell> single(3, OneCell(m));
    for (uint32_t i = 0; i < 60; ++i) {
      const float u = numbers.next();
      const std::vector<float> r = m == 1 ? std::vector{1 - u} : std::vector{0.7f * (1 - u), 0.3f * (1 - u)};
      const Spectrum value(numbers.next(), numbers.next(), numbers.next());
      const Spectrum weights(numbers.next(), 10 * numbers.next(), i % 3 == 0 ? 0 : numbers.next());
      all.add_by_channel(cell, weights, {value, i / 20, u, r});
      for (int c = 0; c < 3; ++c) single[static_cast<size_t>(c)].add(weights[c], value, i / 20, u, r);
    }
    SystemSums merged(SystemLayout{m, true});
    merged.merge(all);
    std::vector<float> rows;
    for (size_t i = 0; i < merged.n_rows(); ++i) rows.insert(rows.end(), merged.row(i).begin(), merged.row(i).end());
    const std::vector<uint32_t> lights = {0, 1, 2};
    const SolveSettings settings{0.3, false};
    Coefficients prior = single[0].zeros();
    prior.lights[1] = Spectrum(0.5f, 0.1f, 0.9f);
    const Coefficients result = fast({merged.layout(), merged.head(cell), lights, rows}, prior, settings);
    for (int c = 0; c < 3; ++c) {
      const Coefficients own = fast(single[static_cast<size_t>(c)].view(), prior, settings);
      for (size_t k = 0; k < 3; ++k) EXPECT_NEAR(result.lights[k][c], own.lights[k][c], 1e-4f) << m << c << k;
      for (size_t j = 0; j < m; ++j) EXPECT_NEAR(result.dense[j][c], own.dense[j][c], 1e-4f) << m << c << j;
    }
  }
}

/// Systems that leave combinations of coefficients undetermined: these keep the prior.
TEST(CoefficientSolver, BlockArrowEqualsDenseOnSingularSystems) {
  Numbers numbers;
  for (const float spread : {0.0f, 1e-6f, 1e-3f}) {
    OneCell cell(3);
    for (uint32_t light = 0; light < 5; ++light)
      for (int s = 0; s < 6; ++s) {
        // Nearly constant shares, and a third dense technique that never has any.
        const float share = 0.3f + spread * numbers.next();
        const float r[] = {0.5f * (1 - share), 0.5f * (1 - share), 0};
        cell.add(1, {numbers.next(), 1, 2}, light, share, r);
      }
    const Coefficients arrow = fast(cell.view(), cell.zeros());
    EXPECT_LT(largest_difference(arrow, slow(cell.view(), cell.zeros())), 1e-3f) << spread;
    EXPECT_EQ(Spectrum(0), arrow.dense[2]);
    for (const Spectrum& value : arrow.lights) EXPECT_TRUE(is_finite(value));
  }
}

TEST(CoefficientSolver, WithoutSamplesTheResultIsThePrior) {
  OneCell cell(2);
  Coefficients prior = cell.zeros();
  prior.dense = {Spectrum(0.25f), Spectrum(-3)};
  const Coefficients result = fast(cell.view(), prior);
  EXPECT_EQ(prior.dense, result.dense);
}

/// A technique that no sample uses keeps its prior and does not disturb the others.
TEST(CoefficientSolver, TechniquesWithoutSamplesLeaveTheSystem) {
  Numbers numbers;
  OneCell with(2), without(1);
  for (uint32_t light = 0; light < 4; ++light)
    for (int s = 0; s < 9; ++s) {
      const float share = numbers.next(), r[] = {1 - share, 0};
      const Spectrum value(numbers.next(), numbers.next(), 1);
      with.add(1, value, light, share, r);
      without.add(1, value, light, share, {r, 1});
    }
  const Coefficients more = fast(with.view(), with.zeros());
  const Coefficients fewer = fast(without.view(), without.zeros());
  EXPECT_EQ(Spectrum(0), more.dense[1]);
  EXPECT_LT(largest_difference({more.lights, {more.dense[0]}}, fewer), 1e-6f);
}

/// Σ_j A_kj = Σ w r_k, since the weights r of each sample sum to one.
TEST(CoefficientSolver, RowsAddUpToTheWeightsOfTheirTechnique) {
  Numbers numbers;
  OneCell cell(3);
  std::vector<double> lights(4), dense(3);
  double weights = 0;
  for (uint32_t light = 0; light < 4; ++light)
    for (int s = 0; s < 20; ++s) {
      float r[3], own = numbers.next(), total = own;
      for (float& x : r) total += x = numbers.next();
      for (float& x : r) x /= total;
      const float weight = numbers.next();
      cell.add(weight, Spectrum(1), light, own / total, r);
      lights[light] += weight * own / total, weights += weight;
      for (int j = 0; j < 3; ++j) dense[static_cast<size_t>(j)] += weight * r[j];
    }
  const SystemView view = cell.view();
  std::vector<double> dense_rows(3);
  for (uint32_t k = 0; k < 4; ++k) {
    const auto row = view.rows.subspan(k * view.layout.row_size(), view.layout.row_size());
    double sum = row[SystemLayout::kDiagonal];
    for (uint32_t j = 0; j < 3; ++j)
      sum += row[SystemLayout::kRowDense + j], dense_rows[j] += row[SystemLayout::kRowDense + j];
    EXPECT_NEAR(lights[k], sum, 1e-5);
  }
  for (uint32_t j = 0; j < 3; ++j) {
    for (uint32_t i = 0; i < 3; ++i) dense_rows[j] += view.head[view.layout.matrix(i, j)];
    EXPECT_NEAR(dense[j], dense_rows[j], 1e-5);
  }
  EXPECT_NEAR(weights, view.head[SystemLayout::kWeight], 1e-5);
}

TEST(CoefficientSolver, LittleDataStaysNearThePrior) {
  OneCell cell(0);
  for (int s = 0; s < 4; ++s) cell.add(1, Spectrum(4), 0, 1, {});
  for (int s = 0; s < 4; ++s) cell.add(1, Spectrum(0), 1, 1, {});
  // The mean is 2, so coefficients are 2 above and below it; with a prior of 4 samples, half of that.
  const Coefficients free = fast(cell.view(), cell.zeros());
  EXPECT_NEAR(4, free.lights[0].r - free.lights[1].r, 1e-5);
  const Coefficients drawn = fast(cell.view(), cell.zeros(), {4});
  EXPECT_NEAR(2, drawn.lights[0].r - drawn.lights[1].r, 1e-5);
}

/// A light found now and then by directions and never by light samples: its weights r are tiny, and without a prior its
/// coefficient would be correspondingly large.
TEST(CoefficientSolver, TinyWeightsGiveNoLargeCoefficients) {
  OneCell cell(1);
  const float always = 1, nearly = 1 - 1e-4f;
  for (int s = 0; s < 50; ++s) cell.add(1, Spectrum(1), ControlledSample::kNoLight, 0, {&always, 1});
  cell.add(1, Spectrum(9), 0, 1e-4f, {&nearly, 1});
  EXPECT_GT(fast(cell.view(), cell.zeros()).lights[0].r, 1e3f);
  EXPECT_LT(std::abs(fast(cell.view(), cell.zeros(), {4}).lights[0].r), 0.01f);
}

/// A sample with nearly all the weight counts as one sample.
TEST(CoefficientSolver, OneHeavySampleIsNotMuchData) {
  OneCell cell(0);
  for (int s = 0; s < 100; ++s) cell.add(1e-3f, Spectrum(1), s % 2, 1, {});
  cell.add(100, Spectrum(50), 0, 1, {});
  const Coefficients drawn = fast(cell.view(), cell.zeros(), {4});
  EXPECT_NEAR(0, drawn.lights[0].r - drawn.lights[1].r, 0.1f);
}

TEST(CoefficientSolver, ShareOfTheControlIsWhatHeldOutVerticesSay) {
  OneCell cell(0);
  const auto share = [&](double prior) { return best_fraction(cell.view(), {1, 0.5f, 0}, prior, false); };
  EXPECT_EQ(Spectrum(1, 0.5f, 0), share(10)) << "no data";
  for (int i = 0; i < 10; ++i) {
    // Red: the control removes all noise. Green: half of it would be best. Blue: it adds noise.
    const float sign = i % 2 ? 1.0f : -1.0f;
    cell.sums.add_held_out(cell.cell, 1, Spectrum(1 + sign), {-sign, -2 * sign, sign});
  }
  EXPECT_EQ(Spectrum(1, 0.5f, 0), share(0));
  EXPECT_EQ(Spectrum(1, 0.5f, 0), share(10));
  const Spectrum one = best_fraction(cell.view(), Spectrum(1), 0, true);
  EXPECT_NEAR((1 + 2 - 1) / (1.0 + 4 + 1), one.r, 1e-6);
  EXPECT_EQ(one.r, one.b);
}

/// A plain estimate with a large mean and a control whose sample mean is not 0.
TEST(CoefficientSolver, ShareIsOneWhereTheControlLeavesAConstant) {
  OneCell cell(0);
  const float controls[] = {-1, 0.5f, 3, 2, 0.25f};
  for (const float c : controls) cell.sums.add_held_out(cell.cell, 2 + c, Spectrum(100 - c), Spectrum(c));
  const Spectrum fraction = best_fraction(cell.view(), Spectrum(), 0, false);
  for (int c = 0; c < 3; ++c) EXPECT_NEAR(1, fraction[c], 1e-6);
}

TEST(CoefficientSolver, EqualVerticesSayNothingOfTheShare) {
  OneCell cell(0);
  for (int i = 0; i < 3; ++i) cell.sums.add_held_out(cell.cell, 1, Spectrum(0.1f), Spectrum(0.3f));
  EXPECT_EQ(Spectrum(0.5f), best_fraction(cell.view(), Spectrum(0.5f), 0, false));
}

TEST(CoefficientSolver, WeightIsTheMeanOfSquaredFactors) {
  EXPECT_FLOAT_EQ((4 + 9 + 0) / 3.0f, variance_weight({1, 3, 0}, {2, 1, 5}));
}

}  // namespace
}  // namespace covary
