// SPDX-License-Identifier: Apache-2.0
#include "sampling/coefficient_solver.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

namespace covary {
namespace {

// Minimum weight of the prior, relative to the diagonal: it decides what samples leave undetermined and changes other
// coefficients by 1e-8.
constexpr double kMinPrior = 1e-8;

using Layout = SystemLayout;
using Rgb = Eigen::Array3d;
using DenseMatrix =
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, Layout::kMaxDense, Layout::kMaxDense>;
using DenseRgb = Eigen::Matrix<double, 3, Eigen::Dynamic, Eigen::ColMajor, 3, Layout::kMaxDense>;

template <typename T>
Rgb rgb(const T* numbers) {
  return {static_cast<double>(numbers[0]), static_cast<double>(numbers[1]), static_cast<double>(numbers[2])};
}
Rgb rgb(const Spectrum& s) { return {s.r, s.g, s.b}; }
Spectrum spectrum(const Rgb& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2])};
}

/// What the prior adds to the diagonal of A. One sample has the weight of a typical one, Σw² / Σw: if a few samples
/// have nearly all the weight, the prior is compared with these few.
class Prior {
 public:
  Prior(const SystemView& system, const SolveSettings& settings) {
    const double weight = system.head[Layout::kWeight];
    if (weight > 0) weight_ = settings.prior_samples * system.head[Layout::kWeightSquared] / weight;
  }
  double diagonal(double a) const { return a * (1 + kMinPrior) + weight_; }

 private:
  double weight_ = 0;
};

/// Right-hand sides of (A + prior weight) x = b − A (prior + constant); x is the solution minus the prior.
struct Residuals {
  std::vector<Rgb> lights;
  DenseRgb dense;  // one column per technique
};

Residuals residuals(const SystemView& system, const CoefficientsView& prior, bool monochrome) {
  const Layout& layout = system.layout;
  const uint32_t m = layout.n_dense;
  const double* head = system.head.data();
  Residuals result;
  result.lights.resize(system.lights.size());
  result.dense.resize(3, m);

  // Row sums of A are Σ w r, because the weights r of a sample sum to one.
  std::vector<double> light_sums(system.lights.size());
  double dense_sums[Layout::kMaxDense];
  Rgb total = rgb(head + Layout::kValue);
  for (uint32_t j = 0; j < m; ++j) {
    Rgb r = rgb(head + layout.dense(j));
    dense_sums[j] = 0;
    for (uint32_t i = 0; i < m; ++i) {
      const double a = head[layout.matrix(i, j)];
      dense_sums[j] += a, r -= a * rgb(prior.dense[i]);
    }
    result.dense.col(j) = r;
  }
  for (size_t k = 0; k < system.lights.size(); ++k) {
    const float* row = &system.rows[k * layout.row_size()];
    const Rgb own = rgb(prior.lights[k]);
    double sum = row[Layout::kDiagonal];
    Rgb r = rgb(row + Layout::kRowValue) - sum * own;
    for (uint32_t j = 0; j < m; ++j) {
      const double a = row[Layout::kRowDense + j];
      if (a == 0) continue;
      sum += a, dense_sums[j] += a;
      r -= a * rgb(prior.dense[j]);
      result.dense.col(j).array() -= a * own;
    }
    result.lights[k] = r, light_sums[k] = sum;
    total -= sum * own;
  }
  for (uint32_t j = 0; j < m; ++j) total -= dense_sums[j] * rgb(prior.dense[j]);

  // The constant that makes the mean residual of the prior vanish.
  const double weight = head[Layout::kWeight];
  const Rgb constant = weight > 0 ? Rgb(total / weight) : Rgb(Rgb::Zero());
  for (size_t k = 0; k < result.lights.size(); ++k) result.lights[k] -= light_sums[k] * constant;
  for (uint32_t j = 0; j < m; ++j) result.dense.col(j).array() -= dense_sums[j] * constant;

  if (monochrome) {
    for (Rgb& r : result.lights) r = r.mean();
    for (uint32_t j = 0; j < m; ++j) result.dense.col(j).setConstant(result.dense.col(j).mean());
  }
  return result;
}

/// Solves matrix · x = right for each row of `right`. Techniques whose diagonal in A is not positive are left out: x =
/// 0.
template <typename Matrix, typename Right>
void solve_scaled(Matrix& matrix, const double* diagonal, Right& right) {
  // Scale to a unit diagonal, so that techniques of very different weight do not disturb each other.
  const Eigen::Index n = matrix.rows();
  Eigen::Matrix<double, Eigen::Dynamic, 1, 0, Matrix::MaxRowsAtCompileTime, 1> scale(n);
  for (Eigen::Index i = 0; i < n; ++i) scale[i] = diagonal[i] > 0 ? 1 / std::sqrt(diagonal[i]) : 0;
  matrix = (scale.asDiagonal() * matrix * scale.asDiagonal()).eval();
  for (Eigen::Index i = 0; i < n; ++i)
    if (scale[i] == 0) matrix(i, i) = 1;
  const Eigen::LDLT<Matrix> factors(matrix);
  right = (factors.solve(scale.asDiagonal() * right.transpose()).transpose() * scale.asDiagonal()).eval();
}

/// Adds the differences to the prior, unless any is not finite.
template <typename Dense>
void add_differences(const std::vector<Rgb>& lights, const Dense& dense, CoefficientsView& coefficients) {
  bool finite = dense.allFinite();
  for (const Rgb& light : lights) finite = finite && light.allFinite();
  if (!finite) return;
  for (size_t k = 0; k < lights.size(); ++k) coefficients.lights[k] += spectrum(lights[k]);
  for (size_t j = 0; j < coefficients.dense.size(); ++j)
    coefficients.dense[j] += spectrum(dense.col(static_cast<Eigen::Index>(j)).array());
}

/// A by-channel system: solves each channel as a system of its own and keeps only that channel of the solution.
void solve_by_channel(const SystemView& system, const SolveSettings& settings, CoefficientsView coefficients) {
  const Layout& layout = system.layout;
  const Layout single{layout.n_dense};
  const std::vector<Spectrum> light_prior(coefficients.lights.begin(), coefficients.lights.end());
  const std::vector<Spectrum> dense_prior(coefficients.dense.begin(), coefficients.dense.end());
  std::vector<double> head(system.head.begin(), system.head.begin() + single.head_size());
  std::vector<float> rows(system.lights.size() * single.row_size());
  for (uint32_t c = 0; c < 3; ++c) {
    const double* own = system.head.data() + layout.channel(c);
    head[Layout::kWeight] = own[0], head[Layout::kWeightSquared] = own[1];
    std::copy_n(own + 2, layout.matrix_size(), head.begin() + single.matrix(0, 0));
    for (size_t k = 0; k < system.lights.size(); ++k) {
      const float* from = system.rows.data() + k * layout.row_size();
      float* to = rows.data() + k * single.row_size();
      std::copy_n(from, single.row_size(), to);
      to[Layout::kDiagonal] = from[layout.channel_row(c)];
      std::copy_n(from + layout.channel_row(c) + 1, layout.n_dense, to + Layout::kRowDense);
    }
    std::vector<Spectrum> lights = light_prior, dense = dense_prior;
    solve_block_arrow({single, head, system.lights, rows}, settings, {lights, dense});
    const auto channel = static_cast<int>(c);
    for (size_t k = 0; k < lights.size(); ++k) coefficients.lights[k][channel] = lights[k][channel];
    for (size_t j = 0; j < dense.size(); ++j) coefficients.dense[j][channel] = dense[j][channel];
  }
}

}  // namespace

void solve_block_arrow(const SystemView& system, const SolveSettings& settings, CoefficientsView coefficients) {
  const Layout& layout = system.layout;
  if (layout.by_channel) return solve_by_channel(system, settings, coefficients);
  const uint32_t m = layout.n_dense;
  Residuals right = residuals(system, coefficients, settings.monochrome);

  const Prior prior(system, settings);
  DenseMatrix matrix(m, m);
  double diagonal[Layout::kMaxDense];
  for (uint32_t j = 0; j < m; ++j) {
    for (uint32_t i = 0; i < m; ++i) matrix(i, j) = system.head[layout.matrix(i, j)];
    matrix(j, j) = prior.diagonal(matrix(j, j));
    diagonal[j] = matrix(j, j);
  }
  // Eliminate the rows of the lights: [Hua2023] Eq. (32).
  std::vector<double> inverse(system.lights.size());
  for (size_t k = 0; k < system.lights.size(); ++k) {
    const float* row = &system.rows[k * layout.row_size()];
    const double own = prior.diagonal(row[Layout::kDiagonal]);
    inverse[k] = own > 0 ? 1 / own : 0;
    for (uint32_t j = 0; j < m; ++j) {
      const double factor = row[Layout::kRowDense + j] * inverse[k];
      if (factor == 0) continue;
      for (uint32_t i = 0; i < m; ++i) matrix(i, j) -= factor * row[Layout::kRowDense + i];
      right.dense.col(j).array() -= factor * right.lights[k];
    }
  }
  if (m > 0) solve_scaled(matrix, diagonal, right.dense);
  // [Hua2023] Eq. (33).
  for (size_t k = 0; k < system.lights.size(); ++k) {
    const float* row = &system.rows[k * layout.row_size()];
    for (uint32_t j = 0; j < m; ++j)
      right.lights[k] -= static_cast<double>(row[Layout::kRowDense + j]) * right.dense.col(j).array();
    right.lights[k] *= inverse[k];
  }
  add_differences(right.lights, right.dense, coefficients);
}

void solve_dense(const SystemView& system, const SolveSettings& settings, CoefficientsView coefficients) {
  const Layout& layout = system.layout;
  const auto n = static_cast<Eigen::Index>(system.lights.size()), m = static_cast<Eigen::Index>(layout.n_dense);
  Residuals parts = residuals(system, coefficients, settings.monochrome);
  const Prior prior(system, settings);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(n + m, n + m);
  Eigen::Matrix<double, 3, Eigen::Dynamic> right(3, n + m);
  for (Eigen::Index k = 0; k < n; ++k) {
    const float* row = &system.rows[static_cast<size_t>(k) * layout.row_size()];
    matrix(k, k) = prior.diagonal(row[Layout::kDiagonal]);
    for (Eigen::Index j = 0; j < m; ++j) matrix(k, n + j) = matrix(n + j, k) = row[Layout::kRowDense + j];
    right.col(k) = parts.lights[static_cast<size_t>(k)];
  }
  for (Eigen::Index j = 0; j < m; ++j) {
    const auto own = static_cast<uint32_t>(j);
    for (uint32_t i = 0; i < layout.n_dense; ++i) matrix(n + i, n + j) = system.head[layout.matrix(i, own)];
    matrix(n + j, n + j) = prior.diagonal(matrix(n + j, n + j));
    right.col(n + j) = parts.dense.col(j);
  }
  const Eigen::VectorXd diagonal = matrix.diagonal();
  solve_scaled(matrix, diagonal.data(), right);
  for (Eigen::Index k = 0; k < n; ++k) parts.lights[static_cast<size_t>(k)] = right.col(k);
  add_differences(parts.lights, right.rightCols(m), coefficients);
}

Spectrum best_fraction(const SystemView& system, const Spectrum& parent, double prior_vertices, bool monochrome) {
  const double* head = system.head.data();
  const double n = head[Layout::kHeldOut], weight = head[Layout::kHeldOutWeight];
  if (!(n > 0 && weight > 0)) return parent;
  // Both are centred: otherwise the mean of the plain estimate, times the residual noise in the control's mean (0 in
  // expectation), would hide the fraction.
  const Rgb control = rgb(head + Layout::kControl) / weight;
  Rgb cross = rgb(head + Layout::kPlainControl) - rgb(head + Layout::kPlain) * control;
  Rgb second = rgb(head + Layout::kControlSquared);
  Rgb squared = second - weight * control * control;
  if (monochrome) cross = cross.mean(), second = second.mean(), squared = squared.mean();
  const double prior = prior_vertices / n;
  Spectrum result = parent;
  for (int c = 0; c < 3; ++c) {
    if (!(squared[c] > 1e-9 * second[c])) continue;  // one vertex, or identical ones, carry no information
    // The variance of plain + s · control is minimal at s = −Cov(plain, control) / Var(control).
    const double fraction = (-cross[c] / squared[c] + prior * parent[c]) / (1 + prior);
    result[c] = static_cast<float>(std::clamp(fraction, 0.0, 1.0));
  }
  return result;
}

}  // namespace covary
