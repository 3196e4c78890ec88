// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_solver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace covary {
namespace {

// Least pull towards the prior, relative to the diagonal: it decides what samples leave open and costs 1e-8 of a
// coefficient elsewhere.
constexpr double kLeastPull = 1e-8;

using Rgb = Eigen::Array3d;
using DenseMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor, SystemLayout::kMaxDense,
                                  SystemLayout::kMaxDense>;
using DenseRgb = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor, SystemLayout::kMaxDense, 3>;

Rgb rgb(const double* numbers) { return {numbers[0], numbers[1], numbers[2]}; }
Rgb rgb(const Spectrum& s) { return {s.r, s.g, s.b}; }
Spectrum spectrum(const Rgb& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

double pull(double n_samples, const SolveSettings& settings) {
  return n_samples > 0 ? settings.prior_samples / n_samples + kLeastPull : 1;
}

/// A system for the difference between solution and prior: (A + pull) difference = b − A (prior + constant).
struct Residuals {
  std::vector<Rgb> lights;
  DenseRgb dense;
};

Residuals residuals(const SystemView& system, const Coefficients& prior, bool monochrome) {
  const SystemLayout& layout = system.layout;
  const uint32_t m = layout.n_dense;
  const double* head = system.head.data();
  Residuals result;
  result.lights.resize(system.lights.size());
  result.dense.resize(m, 3);

  // Row sums of A are Σ w r, because the weights r of a sample add up to one.
  Eigen::Array<double, Eigen::Dynamic, 1, 0, SystemLayout::kMaxDense, 1> row_sums(m);
  std::vector<double> light_sums(system.lights.size());
  Rgb total = rgb(head + SystemLayout::kValue);
  for (uint32_t j = 0; j < m; ++j) {
    row_sums[j] = 0;
    Rgb r = rgb(head + layout.dense(j) + 1);
    for (uint32_t i = 0; i < m; ++i) {
      const double a = head[layout.matrix(i, j)];
      row_sums[j] += a, r -= a * rgb(prior.dense[i]);
    }
    result.dense.row(j) = r;
  }
  for (size_t k = 0; k < system.lights.size(); ++k) {
    const double* row = &system.rows[k * layout.row_size()];
    const Rgb own = rgb(prior.lights[k]);
    light_sums[k] = row[SystemLayout::kDiagonal];
    Rgb r = rgb(row + SystemLayout::kRowValue) - row[SystemLayout::kDiagonal] * own;
    for (uint32_t j = 0; j < m; ++j) {
      const double a = row[SystemLayout::kRowDense + j];
      light_sums[k] += a, row_sums[j] += a;
      r -= a * rgb(prior.dense[j]);
      result.dense.row(j).array() -= a * own.transpose();
    }
    result.lights[k] = r;
    total -= light_sums[k] * own;
  }
  for (uint32_t j = 0; j < m; ++j) total -= row_sums[j] * rgb(prior.dense[j]);

  // The constant that makes the prior's residuals vanish in the mean.
  const double weight = head[SystemLayout::kWeight];
  const Rgb constant = weight > 0 ? Rgb(total / weight) : Rgb(Rgb::Zero());
  for (size_t k = 0; k < result.lights.size(); ++k) result.lights[k] -= light_sums[k] * constant;
  for (uint32_t j = 0; j < m; ++j) result.dense.row(j).array() -= row_sums[j] * constant.transpose();

  if (monochrome) {
    for (Rgb& r : result.lights) r = r.mean();
    for (uint32_t j = 0; j < m; ++j) result.dense.row(j).setConstant(result.dense.row(j).mean());
  }
  return result;
}

/// Solves matrix · x = right, where techniques whose `diagonal` is not above zero are left out: x = 0.
template <typename Matrix, typename Right>
Right solve_scaled(Matrix matrix, const Eigen::ArrayXd& diagonal, Right right) {
  const Eigen::Index n = matrix.rows();
  // A unit diagonal, so that techniques of very different weight do not disturb each other.
  Eigen::VectorXd scale(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const bool used = diagonal[i] > 0;
    scale[i] = used ? 1 / std::sqrt(diagonal[i]) : 0;
  }
  matrix = scale.asDiagonal() * matrix * scale.asDiagonal();
  right = scale.asDiagonal() * right;
  for (Eigen::Index i = 0; i < n; ++i)
    if (scale[i] == 0) matrix(i, i) = 1;
  const Eigen::LDLT<Matrix> factors(matrix);
  return scale.asDiagonal() * factors.solve(right);
}

Coefficients sum_or_prior(const Coefficients& prior, const std::vector<Rgb>& lights, const DenseRgb& dense) {
  Coefficients result = prior;
  bool finite = true;
  for (size_t k = 0; k < lights.size(); ++k) {
    result.lights[k] = spectrum(rgb(prior.lights[k]) + lights[k]);
    finite = finite && is_finite(result.lights[k]);
  }
  for (size_t j = 0; j < prior.dense.size(); ++j) {
    result.dense[j] = spectrum(rgb(prior.dense[j]) + dense.row(static_cast<Eigen::Index>(j)).transpose().array());
    finite = finite && is_finite(result.dense[j]);
  }
  return finite ? result : prior;
}

}  // namespace

Coefficients solve_block_arrow(const SystemView& system, const Coefficients& prior, const SolveSettings& settings) {
  const SystemLayout& layout = system.layout;
  const uint32_t m = layout.n_dense;
  Residuals right = residuals(system, prior, settings.monochrome);

  DenseMatrix matrix(m, m);
  Eigen::ArrayXd diagonal(m);
  for (uint32_t j = 0; j < m; ++j) {
    for (uint32_t i = 0; i < m; ++i) matrix(i, j) = system.head[layout.matrix(i, j)];
    matrix(j, j) *= 1 + pull(system.head[layout.dense(j)], settings);
    diagonal[j] = matrix(j, j);
  }
  // The lights' rows, put into the others: [Hua2023] Eq. (32).
  std::vector<double> light_diagonal(system.lights.size());
  for (size_t k = 0; k < system.lights.size(); ++k) {
    const double* row = &system.rows[k * layout.row_size()];
    light_diagonal[k] = row[SystemLayout::kDiagonal] * (1 + pull(row[SystemLayout::kRowSamples], settings));
    if (light_diagonal[k] <= 0) continue;
    for (uint32_t j = 0; j < m; ++j) {
      const double factor = row[SystemLayout::kRowDense + j] / light_diagonal[k];
      if (factor == 0) continue;
      for (uint32_t i = 0; i < m; ++i) matrix(i, j) -= factor * row[SystemLayout::kRowDense + i];
      right.dense.row(j).array() -= factor * right.lights[k].transpose();
    }
  }
  const DenseRgb dense = m > 0 ? solve_scaled(matrix, diagonal, right.dense) : right.dense;
  // [Hua2023] Eq. (33).
  for (size_t k = 0; k < system.lights.size(); ++k) {
    const double* row = &system.rows[k * layout.row_size()];
    for (uint32_t j = 0; j < m; ++j)
      right.lights[k] -= row[SystemLayout::kRowDense + j] * dense.row(j).transpose().array();
    right.lights[k] *= light_diagonal[k] > 0 ? 1 / light_diagonal[k] : 0;
  }
  return sum_or_prior(prior, right.lights, dense);
}

Coefficients solve_dense(const SystemView& system, const Coefficients& prior, const SolveSettings& settings) {
  const SystemLayout& layout = system.layout;
  const auto n = static_cast<Eigen::Index>(system.lights.size()), m = static_cast<Eigen::Index>(layout.n_dense);
  const Residuals parts = residuals(system, prior, settings.monochrome);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + m, n + m);
  Eigen::Matrix<double, Eigen::Dynamic, 3> right(n + m, 3);
  Eigen::ArrayXd diagonal(n + m);
  for (Eigen::Index k = 0; k < n; ++k) {
    const double* row = &system.rows[static_cast<size_t>(k) * layout.row_size()];
    matrix(k, k) = row[SystemLayout::kDiagonal] * (1 + pull(row[SystemLayout::kRowSamples], settings));
    for (Eigen::Index j = 0; j < m; ++j) matrix(k, n + j) = matrix(n + j, k) = row[SystemLayout::kRowDense + j];
    right.row(k) = parts.lights[static_cast<size_t>(k)];
  }
  for (Eigen::Index j = 0; j < m; ++j) {
    const auto own = static_cast<uint32_t>(j);
    for (uint32_t i = 0; i < layout.n_dense; ++i) matrix(n + i, n + j) = system.head[layout.matrix(i, own)];
    matrix(n + j, n + j) *= 1 + pull(system.head[layout.dense(own)], settings);
    right.row(n + j) = parts.dense.row(j);
  }
  diagonal = matrix.diagonal().array();
  const Eigen::Matrix<double, Eigen::Dynamic, 3> solution = solve_scaled(matrix, diagonal, right);
  std::vector<Rgb> lights(system.lights.size());
  for (Eigen::Index k = 0; k < n; ++k) lights[static_cast<size_t>(k)] = solution.row(k).transpose().array();
  return sum_or_prior(prior, lights, solution.bottomRows(m));
}

Spectrum best_share(const SystemView& system, const Spectrum& parent, double prior_vertices, bool monochrome) {
  const double* head = system.head.data();
  const double n = head[SystemLayout::kHeldOut];
  Rgb cross = rgb(head + SystemLayout::kPlainControl), squared = rgb(head + SystemLayout::kControlSquared);
  if (monochrome) cross = cross.mean(), squared = squared.mean();
  Spectrum result = parent;
  for (int c = 0; c < 3; ++c) {
    if (!(n > 0 && squared[c] > 0)) continue;
    const double prior = prior_vertices / n;
    // The least second moment of plain + s · control lies at s = −Σ w plain control / Σ w control².
    const double share = (-cross[c] / squared[c] + prior * parent[c]) / (1 + prior);
    result[c] = static_cast<float>(std::clamp(share, 0.0, 1.0));
  }
  return result;
}

}  // namespace covary
