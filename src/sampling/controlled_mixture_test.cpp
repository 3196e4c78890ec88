// SPDX-License-Identifier: Apache-2.0
// Theoretical properties of [Hua2023] (Sec. 3 to 5), by quadrature over integrands and densities in one and two
// dimensions: no random numbers, so every statement is exact up to rounding.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <functional>

#include "core/vec.h"
#include "sampling/coefficient_solver.h"
#include "sampling/system_sums.h"

namespace covary {
namespace {

constexpr uint32_t kNoLight = ControlledSample::kNoLight;

struct Coefficients {
  std::vector<Spectrum> lights, dense;
};

/// A sampling technique: expected number of samples, density at each node.
struct Technique {
  double count;
  std::vector<double> density;
  uint32_t strategy;  ///< techniques of one strategy are components of its mixture, one of which is chosen at random
};

/// An integral over equal cells of the unit line or square, with its sampling techniques.
struct Problem {
  size_t n_nodes;
  std::vector<Spectrum> integrand;
  std::vector<Technique> lights, dense;

  double p(size_t x) const {
    double sum = 0;
    for (const auto* list : {&lights, &dense})
      for (const Technique& t : *list) sum += t.count * t.density[x];
    return sum;
  }
  /// The light whose density is positive at x; lights do not overlap.
  uint32_t light_at(size_t x) const {
    for (uint32_t k = 0; k < lights.size(); ++k)
      if (lights[k].density[x] > 0) return k;
    return kNoLight;
  }
  double r(const Technique& t, size_t x) const { return t.count * t.density[x] / p(x); }

  Coefficients solve(bool monochrome = false) const {
    SystemSums sums(SystemLayout{static_cast<uint32_t>(dense.size())});
    const uint32_t cell = sums.cell({});
    for (uint32_t k = 0; k <= lights.size(); ++k)  // light by light, so that rows are sorted
      for (size_t x = 0; x < n_nodes; ++x) {
        const uint32_t light = light_at(x);
        if (light != (k < lights.size() ? k : kNoLight)) continue;
        std::vector<float> weights;
        for (const Technique& t : dense) weights.push_back(static_cast<float>(r(t, x)));
        const double density = p(x);
        if (density == 0) continue;
        sums.add(cell, static_cast<float>(density / static_cast<double>(n_nodes)),
                 {integrand[x] / static_cast<float>(density), light,
                  light == kNoLight ? 0 : static_cast<float>(r(lights[light], x)), weights});
      }
    std::vector<uint32_t> numbers;
    std::vector<float> rows;
    for (size_t i = 0; i < sums.n_rows(); ++i) {
      numbers.push_back(sums.row_light(i));
      rows.insert(rows.end(), sums.row(i).begin(), sums.row(i).end());
    }
    const SystemView view{sums.layout(), sums.head(cell), numbers, rows};
    Coefficients found = equal(Spectrum(0));
    found.lights.resize(numbers.size());
    const CoefficientsView coefficients{found.lights, found.dense};
    solve_block_arrow(view, {0, monochrome}, coefficients);
    return found;
  }

  /// Variance of the estimate with one set of samples per strategy and coefficients β.
  Spectrum variance(const Coefficients& beta) const {
    Spectrum result;
    for (int c = 0; c < 3; ++c) {
      double second = 0;
      std::vector<double> first, count;
      const auto add = [&](const Technique& t, size_t x, double g) {
        if (t.strategy >= first.size()) first.resize(t.strategy + 1), count.resize(t.strategy + 1);
        first[t.strategy] += t.count * t.density[x] * g / static_cast<double>(n_nodes);
        if (x == 0) count[t.strategy] += t.count;
      };
      for (size_t x = 0; x < n_nodes; ++x) {
        if (p(x) == 0) continue;
        double g = integrand[x][c] / p(x);  // controlled f/p
        for (size_t k = 0; k < lights.size(); ++k) g -= beta.lights[k][c] * r(lights[k], x);
        for (size_t j = 0; j < dense.size(); ++j) g -= beta.dense[j][c] * r(dense[j], x);
        second += p(x) * g * g / static_cast<double>(n_nodes);
        for (const Technique& t : lights) add(t, x, g);
        for (const Technique& t : dense) add(t, x, g);
      }
      for (size_t s = 0; s < first.size(); ++s)
        if (count[s] > 0) second -= first[s] * first[s] / count[s];
      result[c] = static_cast<float>(second);
    }
    return result;
  }
  Coefficients equal(const Spectrum& value) const {
    return {std::vector<Spectrum>(lights.size(), value), std::vector<Spectrum>(dense.size(), value)};
  }
  Spectrum plain_variance() const { return variance(equal(Spectrum(0))); }
};

std::vector<double> normalised(std::vector<double> values) {
  double sum = 0;
  for (double v : values) sum += v;
  for (double& v : values) v *= static_cast<double>(values.size()) / sum;
  return values;
}

/// f at the midpoints of n cells of [0, 1], as a density.
std::vector<double> density(size_t n, const std::function<double(double)>& f) {
  std::vector<double> values(n);
  for (size_t i = 0; i < n; ++i) values[i] = f((static_cast<double>(i) + 0.5) / static_cast<double>(n));
  return normalised(std::move(values));
}

std::vector<Spectrum> integrand(size_t n, const std::function<Spectrum(double)>& f) {
  std::vector<Spectrum> values(n);
  for (size_t i = 0; i < n; ++i) values[i] = f((static_cast<double>(i) + 0.5) / static_cast<double>(n));
  return values;
}

double bump(double x, double centre, double width) { return std::exp(-0.5 * std::pow((x - centre) / width, 2)); }

/// Three adjacent lights with given probabilities, a broad BSDF and an environment; no density matches the integrand.
Problem many_lights() {
  constexpr size_t n = 600;
  Problem problem{n, {}, {}, {}};
  const double probability[] = {0.2, 0.5, 0.3};
  for (size_t k = 0; k < 3; ++k)
    problem.lights.push_back({probability[k],
                              density(n,
                                      [&](double x) {
                                        const bool inside =
                                            x > 0.3 * static_cast<double>(k) && x <= 0.3 * (static_cast<double>(k) + 1);
                                        return inside ? 1 + x : 0;
                                      }),
                              0});
  problem.dense.push_back({1, density(n, [](double x) { return bump(x, 0.4, 0.2) + 1e-3; }), 1});
  problem.dense.push_back({1, density(n, [](double x) { return x > 0.9 ? 1 : 0; }), 2});
  problem.integrand = integrand(n, [](double x) {
    const double cosine = bump(x, 0.35, 0.15) + 0.1;
    return Spectrum(static_cast<float>(cosine * (x < 0.3 ? 5 : 1)), static_cast<float>(cosine * (x < 0.6 ? 2 : 0.1)),
                    static_cast<float>(cosine * (x > 0.9 ? 3 : x)));
  });
  return problem;
}

TEST(ControlledMixture, VarianceIsZeroWhereTheIntegrandIsMadeOfTheDensities) {
  Problem problem = many_lights();
  const float share[] = {3, 0, -1, 2, 0.5f};
  for (size_t x = 0; x < problem.n_nodes; ++x) {
    Spectrum f;
    for (size_t i = 0; i < 5; ++i) {
      const Technique& t = i < 3 ? problem.lights[i] : problem.dense[i - 3];
      f += Spectrum(share[i], share[(i + 1) % 5], share[(i + 2) % 5]) * static_cast<float>(t.density[x]);
    }
    problem.integrand[x] = f;
  }
  const Spectrum plain = problem.plain_variance(), controlled = problem.variance(problem.solve());
  for (int c = 0; c < 3; ++c) {
    EXPECT_GT(plain[c], 0.3f);
    EXPECT_NEAR(0, controlled[c], 1e-6f);
  }
}

TEST(ControlledMixture, EqualCoefficientsAreThePlainEstimate) {
  const Problem problem = many_lights();
  const Spectrum plain = problem.plain_variance();
  for (float value : {-2.0f, 1.0f, 30.0f}) {
    const Spectrum shifted = problem.variance(problem.equal(Spectrum(value)));
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(plain[c], shifted[c], 1e-4f * plain[c]);
  }
}

/// The gradient of the variance vanishes, and every step away increases it.
TEST(ControlledMixture, NoOtherCoefficientsAreBetter) {
  const Problem problem = many_lights();
  const Coefficients best = problem.solve();
  const Spectrum least = problem.variance(best), plain = problem.plain_variance();
  for (int c = 0; c < 3; ++c) EXPECT_LT(least[c], 0.7f * plain[c]);
  for (size_t i = 0; i < 5; ++i)
    for (float step : {-0.3f, 0.3f}) {
      Coefficients other = best;
      (i < 3 ? other.lights[i] : other.dense[i - 3]) += Spectrum(step);
      const Spectrum more = problem.variance(other);
      for (int c = 0; c < 3; ++c) EXPECT_GT(more[c], least[c]) << i;
    }
}

/// One coefficient for all channels: no worse than plain in total, no better than one per channel.
TEST(ControlledMixture, MonochromeLiesBetweenPlainAndColour) {
  const Problem problem = many_lights();
  const auto total = [](const Spectrum& v) { return v.r + v.g + v.b; };
  const Coefficients grey = problem.solve(true);
  EXPECT_EQ(grey.lights[0].r, grey.lights[0].b);
  EXPECT_LT(total(problem.variance(grey)), total(problem.plain_variance()));
  EXPECT_LT(total(problem.variance(problem.solve())), total(problem.variance(grey)));
}

/// 100 random problems in one dimension and 100 in two: never worse than the balance heuristic.
TEST(ControlledMixture, IsNeverWorseThanTheBalanceHeuristic) {
  uint64_t state = 1;
  const auto number = [&] { return static_cast<double>(mix64(state++) >> 40) * 0x1p-24; };
  for (int trial = 0; trial < 200; ++trial) {
    const size_t side = 12, n = side * side;
    const bool plane = trial % 2 == 1;
    const auto place = [&](size_t i) {
      const double step = 1.0 / static_cast<double>(plane ? side : n);
      return plane ? Vec2{static_cast<float>(static_cast<double>(i % side) * step),
                          static_cast<float>(static_cast<double>(i / side) * step)}
                   : Vec2{static_cast<float>(static_cast<double>(i) * step), 0};
    };
    const auto smooth = [&](double floor) {
      const Vec2 centre{static_cast<float>(number()), plane ? static_cast<float>(number()) : 0};
      const double width = 0.02 + 0.5 * number();
      std::vector<double> values(n);
      for (size_t i = 0; i < n; ++i) {
        const Vec2 d = place(i) - centre;
        values[i] = std::exp(-dot(d, d) / (width * width)) + floor;
      }
      return values;
    };
    Problem problem{n, std::vector<Spectrum>(n), {}, {}};
    const auto n_lights = static_cast<size_t>(number() * 6);
    for (size_t k = 0; k < n_lights; ++k) {
      std::vector<double> values = smooth(0.1);
      for (size_t i = 0; i < n; ++i)
        if (static_cast<size_t>(place(i).x * static_cast<float>(n_lights)) != k) values[i] = 0;
      problem.lights.push_back({1.0 / static_cast<double>(n_lights), normalised(values), 0});
    }
    problem.dense.push_back({0.6, normalised(smooth(0.01)), 1});
    problem.dense.push_back({0.4, normalised(smooth(0.01)), 1});
    problem.dense.push_back({1, normalised(smooth(0)), 2});
    for (int c = 0; c < 3; ++c) {
      const std::vector<double> a = smooth(0), b = smooth(0);
      for (size_t i = 0; i < n; ++i)
        problem.integrand[i][c] = static_cast<float>(a[i] + (number() < 0.5 ? b[i] : 0) - (trial % 5 == 0 ? 0.3 : 0));
    }
    const Spectrum plain = problem.plain_variance(), controlled = problem.variance(problem.solve());
    for (int c = 0; c < 3; ++c) EXPECT_LE(controlled[c], plain[c] * 1.0001f + 1e-6f) << "trial " << trial;
  }
}

/// [Kondapaneni2019]: the techniques of multiple importance sampling only, each as a whole. Their optimal coefficients
/// solve Σ_j α_j ∫ p_i p_j / p = ∫ f p_i / p (Eq. 16 there); here β_j = α_j / n_j up to a constant.
TEST(ControlledMixture, OptimalMultipleImportanceSamplingIsASpecialCase) {
  Problem problem = many_lights();
  problem.dense.insert(problem.dense.begin(), {1, std::vector<double>(problem.n_nodes), 0});
  for (const Technique& light : problem.lights)
    for (size_t x = 0; x < problem.n_nodes; ++x) problem.dense[0].density[x] += light.count * light.density[x];
  problem.lights.clear();
  problem.dense[1].count = 2;

  const Coefficients found = problem.solve();
  double matrix[3][3] = {}, right[3] = {};
  for (size_t x = 0; x < problem.n_nodes; ++x)
    for (size_t i = 0; i < 3; ++i) {
      const double p = problem.p(x);
      right[i] += problem.integrand[x].r * problem.dense[i].density[x] / p / static_cast<double>(problem.n_nodes);
      for (size_t j = 0; j < 3; ++j)
        matrix[i][j] +=
            problem.dense[i].density[x] * problem.dense[j].density[x] / p / static_cast<double>(problem.n_nodes);
    }
  const auto determinant = [](const double(&m)[3][3]) {
    return m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) - m[0][1] * (m[1][0] * m[2][2] - m[1][2] * m[2][0]) +
           m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  };
  double beta[3];
  for (size_t j = 0; j < 3; ++j) {  // by Cramer's rule
    double replaced[3][3];
    for (size_t i = 0; i < 3; ++i)
      for (size_t k = 0; k < 3; ++k) replaced[i][k] = k == j ? right[i] : matrix[i][k];
    beta[j] = determinant(replaced) / determinant(matrix) / problem.dense[j].count;
  }
  EXPECT_NEAR(beta[1] - beta[0], found.dense[1].r - found.dense[0].r, 1e-4);
  EXPECT_NEAR(beta[2] - beta[0], found.dense[2].r - found.dense[0].r, 1e-4);
}

/// [Vevoda2018]: a control for light samples only, the mean weighted contribution of each light. It results from
/// samples that know no technique but their own: α_k = N_k β_k is the part of F found by samples of light k.
TEST(ControlledMixture, MeanContributionsOfLightsAreASpecialCase) {
  const Problem problem = many_lights();
  SystemSums sums(SystemLayout{0});
  const uint32_t cell = sums.cell({});
  std::vector<double> contribution(3);
  std::vector<uint32_t> lights{0, 1, 2};
  for (uint32_t k = 0; k < 3; ++k)
    for (size_t x = 0; x < problem.n_nodes; ++x) {
      const double own = problem.lights[k].count * problem.lights[k].density[x] / static_cast<double>(problem.n_nodes);
      if (own == 0) continue;
      sums.add(cell, static_cast<float>(own), {problem.integrand[x] / static_cast<float>(problem.p(x)), k, 1, {}});
      contribution[k] += own * problem.integrand[x].r / problem.p(x);
    }
  std::vector<float> rows;
  for (size_t i = 0; i < 3; ++i) rows.insert(rows.end(), sums.row(i).begin(), sums.row(i).end());
  std::vector<Spectrum> found(3);
  solve_block_arrow({sums.layout(), sums.head(cell), lights, rows}, {}, {found, {}});
  for (size_t k = 1; k < 3; ++k)
    EXPECT_NEAR(contribution[k] / problem.lights[k].count - contribution[0] / problem.lights[0].count,
                found[k].r - found[0].r, 1e-4);
}

/// Sec. 5 is about mixtures: one sample, of a randomly chosen component.
Problem mixture(size_t n, std::vector<std::pair<double, std::vector<double>>> components) {
  Problem problem{n, {}, {}, {}};
  for (auto& [share, values] : components) problem.dense.push_back({share, std::move(values), 0});
  return problem;
}

/// [Hua2023] Sec. 5.1, Fig. 3: an environment of constant brightness whose colour varies.
TEST(ControlledMixture, TakesAwayColourNoise) {
  constexpr size_t n = 400;
  Problem problem = mixture(n, {{0.5, density(n, [](double) { return 1; })},
                                {0.25, density(n, [](double x) { return bump(x, 0.25, 0.12); })},
                                {0.25, density(n, [](double x) { return bump(x, 0.75, 0.12); })}});
  problem.integrand = integrand(n, [](double x) {
    const auto blue = static_cast<float>(1 / (1 + std::exp((x - 0.5) / 0.05)));
    return Spectrum(0.1f, 1 - blue, blue);
  });
  const auto total = [](const Spectrum& v) { return v.r + v.g + v.b; };
  const float plain = total(problem.plain_variance());
  EXPECT_LT(total(problem.variance(problem.solve())), 0.5f * plain);
  EXPECT_GT(total(problem.variance(problem.solve(true))), 0.8f * plain);
}

/// Sec. 5.2, Fig. 4: a sine, sampled by its positive and negative parts.
TEST(ControlledMixture, TakesAwayTheNoiseOfSigns) {
  constexpr size_t n = 400;
  const auto sine = [](double x) { return std::sin(2 * static_cast<double>(kPi) * x); };
  Problem problem = mixture(n, {{0.5, density(n, [&](double x) { return std::max(sine(x), 0.0); })},
                                {0.5, density(n, [&](double x) { return std::max(-sine(x), 0.0); })}});
  problem.integrand = integrand(n, [&](double x) { return Spectrum(static_cast<float>(sine(x))); });
  EXPECT_NEAR(std::pow(2 / static_cast<double>(kPi), 2), problem.plain_variance().r, 1e-4);
  EXPECT_NEAR(0, problem.variance(problem.solve()).r, 1e-6);
  // Densities that fit less well: nearly all of the noise is still removed. One sample with control has twice the
  // variance of one sample of each component without, 0.033 and 0.016 in the paper: nothing is left of the choice.
  Problem rough = mixture(n, {{0.5, density(n, [](double x) { return x < 0.5 ? x * (0.5 - x) : 0; })},
                              {0.5, density(n, [](double x) { return x > 0.5 ? (x - 0.5) * (1 - x) : 0; })}});
  rough.integrand = problem.integrand;
  const float controlled = rough.variance(rough.solve()).r;
  EXPECT_LT(controlled, 0.05f * rough.plain_variance().r);
  Problem both = rough;
  for (uint32_t i = 0; i < 2; ++i) both.dense[i].count = 1, both.dense[i].strategy = i;
  EXPECT_NEAR(2, controlled / both.plain_variance().r, 1e-3);
}

/// Sec. 5.3.1, Fig. 5: one component is perfect but rarely chosen.
TEST(ControlledMixture, RestoresThePerfectComponentOfAMixture) {
  constexpr size_t n = 400;
  const auto sky = [](double x) { return 1 - 0.5 * x; };
  Problem problem = mixture(n, {{0.1, density(n, sky)}, {0.9, density(n, [](double x) { return 0.05 + x * x; })}});
  problem.integrand = integrand(n, [&](double x) { return Spectrum(static_cast<float>(sky(x))); });
  EXPECT_GT(problem.plain_variance().r, 0.05f);
  EXPECT_NEAR(0, problem.variance(problem.solve()).r, 1e-6);
}

/// Sec. 5.3.1: the variance is at most σ_t² / c_t for every component t of probability c_t, σ_t² being the variance of
/// its samples alone. The plain mixture does not keep to that.
TEST(ControlledMixture, IsAsGoodAsSamplesOfTheBestComponentAlone) {
  constexpr size_t n = 300;
  uint64_t state = 1;
  const auto number = [&] { return static_cast<double>(mix64(state++) >> 40) * 0x1p-24; };
  int n_plain_above = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const auto smooth = [&] {
      const double centre = number(), width = 0.05 + 0.3 * number(), floor = 0.02 + 0.2 * number();
      return density(n, [=](double x) { return bump(x, centre, width) + floor; });
    };
    const double c = 0.1 + 0.5 * number();
    Problem problem = mixture(n, {{c, smooth()}, {0.9 - c, smooth()}, {0.1, smooth()}});
    const std::vector<double>& near = problem.dense[static_cast<size_t>(trial % 3)].density;
    const double change = 0.2 * number();
    problem.integrand.resize(n);
    for (size_t x = 0; x < n; ++x)
      problem.integrand[x] = Spectrum(static_cast<float>(near[x] + change * std::sin(0.05 * static_cast<double>(x))));
    double bound = 1e30, integral = 0;
    for (const Spectrum& f : problem.integrand) integral += f.r / static_cast<double>(n);
    for (const Technique& t : problem.dense) {
      double second = 0;
      for (size_t x = 0; x < n; ++x)
        second += problem.integrand[x].r * problem.integrand[x].r / t.density[x] / static_cast<double>(n);
      bound = std::min(bound, (second - integral * integral) / t.count);
    }
    EXPECT_LE(problem.variance(problem.solve()).r, 1.0001 * bound + 1e-6) << trial;
    n_plain_above += problem.plain_variance().r > 1.01 * bound + 1e-6;
  }
  EXPECT_GT(n_plain_above, 25);
}

/// Appendix A, Eqs. (34) to (40): adding C_A to all of A and C_B to all of b shifts the solution by n_j c_j C with
/// C = C_A Σ α' − C_B, which changes no estimate; the program's solution is one of the same line.
TEST(ControlledMixture, ShiftedSystemsHaveShiftedSolutions) {
  constexpr size_t n = 400;
  Problem problem = mixture(n, {{0.5, density(n, [](double) { return 1; })},
                                {0.3, density(n, [](double x) { return bump(x, 0.3, 0.2) + 0.01; })},
                                {0.2, density(n, [](double x) { return 0.1 + x * x; })}});
  problem.integrand = integrand(n, [](double x) { return Spectrum(static_cast<float>(std::exp(x) * (x < 0.6))); });
  Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
  Eigen::Vector3d b = Eigen::Vector3d::Zero(), counts;
  for (size_t i = 0; i < 3; ++i) {
    const std::vector<double>& own = problem.dense[i].density;
    const auto row = static_cast<Eigen::Index>(i);
    counts[row] = problem.dense[i].count;
    for (size_t x = 0; x < n; ++x) {
      const double part = own[x] / problem.p(x) / static_cast<double>(n);
      b[row] += part * problem.integrand[x].r;
      for (size_t j = 0; j < 3; ++j) A(row, static_cast<Eigen::Index>(j)) += part * problem.dense[j].density[x];
    }
  }
  const Eigen::Vector3d alpha = A.fullPivLu().solve(b);
  for (const auto& [C_A, C_B] : {std::pair{1.0, 0.5}, std::pair{-0.4, 2.0}, std::pair{3.0, -1.0}}) {
    const Eigen::Matrix3d shifted_A = A.array() + C_A;
    const Eigen::Vector3d shifted = shifted_A.fullPivLu().solve(Eigen::Vector3d(b.array() + C_B));
    const double C = C_A * shifted.sum() - C_B;
    EXPECT_LT((alpha - shifted - C * counts).norm(), 1e-9) << C_A << " " << C_B;
    EXPECT_GT(std::abs(C), 0.1);
  }
  const Coefficients found = problem.solve();
  for (size_t j = 1; j < 3; ++j) {
    const auto row = static_cast<Eigen::Index>(j);
    EXPECT_NEAR(alpha[row] / counts[row] - alpha[0] / counts[0], found.dense[j].r - found.dense[0].r, 1e-4);
  }
}

/// Sec. 5.3.2, Fig. 6: two components oversample the dark sky and undersample the sun.
TEST(ControlledMixture, EasesOversampling) {
  constexpr size_t n = 400;
  const auto light = [](double x) { return 1 + 30 * bump(x, 0.7, 0.02); };
  Problem problem = mixture(n, {{0.5, density(n, [](double) { return 1; })},
                                {0.3, density(n, [](double x) { return 1 + 0.5 * x; })},
                                {0.2, density(n, [](double x) { return bump(x, 0.69, 0.03); })}});
  problem.integrand = integrand(n, [&](double x) { return Spectrum(static_cast<float>(light(x))); });
  EXPECT_LT(problem.variance(problem.solve()).r, 0.67f * problem.plain_variance().r);
  EXPECT_LT(problem.variance(problem.solve(true)).r, 0.67f * problem.plain_variance().r);
}

}  // namespace
}  // namespace covary
