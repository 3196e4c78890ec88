// SPDX-License-Identifier: Apache-2.0
#include "estimators/penalised_fit.h"

#include <algorithm>

#include "filters/batch_algebra.h"

namespace covary {

using namespace lanes;

/// One system: of all channels, or of one of them.
struct PenalisedFit::System {
  System(const FitShape& shape, int first_channel, int n_channels)
      : k(shape.k),
        all(shape.contrasts),
        step(n_channels == 3 ? 1 : 3),
        rows(all / step),
        group_rows(shape.group_contrasts / step),
        first(first_channel),
        n_responses(shape.wants_responses ? n_channels : 0),
        wants_freedom(shape.wants_freedom),
        T1(static_cast<float>(shape.groups - 1)) {}
  int k, all, step, rows, group_rows, first, n_responses;
  bool wants_freedom;
  float T1;
};

void PenalisedFit::prepare(const FitShape& shape) {
  const size_t k = shape.k, rows = shape.contrasts, m = std::min(k, shape.shared ? rows : rows / 3);
  constexpr size_t kMore = 1 + 3 + 3;  // right-hand sides: the target, the rows of the mean constraint, responses
  x.resize(k * rows);
  y.resize(rows);
  penalty.resize(k);
  beta.resize(k);
  gamma.resize(k);
  responses.resize(shape.wants_responses ? 3 * k : 0);
  shift_.resize(m);
  gram_.resize(batch::packed_size(m + kMore));
  inverse_.resize(m);
  b_.resize(std::max<size_t>(batch::kColumnsAtOnce * m, rows));
}

void PenalisedFit::find_coefficients(const FitShape& shape, int first, int count) {
  const System system(shape, first, count);
  if (system.k <= system.rows)
    solve(system);
  else
    solve_dual(system);
  freedom /= system.T1 * static_cast<float>(count);
}

void PenalisedFit::solve(const System& s) {
  const int k = s.k;
  const vfloat *const X = x.data() + s.first, *const Y = y.data() + s.first;
  const auto row = [&](int i) { return gram_.data() + batch::packed(k + 1 + i, 0); };
  batch::gram(X, s.all, s.step, k, s.rows, gram_.data());
  batch::multiply(X, s.all, s.step, Y, k, s.rows, gamma.data());
  for (int i = 0; i < k; ++i) shift_[i] = s.T1 * penalty[i];
  const int n_conditions = s.wants_freedom ? s.rows - s.group_rows : 0;
  for (int r = 0; r < n_conditions; ++r)
    for (int i = 0; i < k; ++i) row(r)[i] = X[static_cast<size_t>(i) * s.all + (s.group_rows + r) * s.step];
  vfloat* const u = responses.data() + static_cast<size_t>(s.first) * k;
  for (int q = 0; q < s.n_responses; ++q) std::copy_n(u + q * k, k, row(n_conditions + q));
  batch::solve_shifted(gram_.data(), shift_.data(), k, gamma.data(), inverse_.data(), n_conditions + s.n_responses);
  std::copy_n(gamma.begin(), k, beta.begin());
  for (int q = 0; q < s.n_responses; ++q) {
    std::copy_n(row(n_conditions + q), k, u + q * k);
    batch::substitute_back(gram_.data(), inverse_.data(), k, u + q * k);
  }
  if (!s.wants_freedom) return;
  freedom =
      splat(static_cast<float>(k)) - batch::inverse_trace(gram_.data(), inverse_.data(), shift_.data(), k, b_.data());
  for (int r = 0; r < n_conditions; ++r) {
    vfloat norm = {};
    for (int i = 0; i < k; ++i) norm = fma(row(r)[i], row(r)[i], norm);
    freedom -= norm;
  }
}

void PenalisedFit::solve_dual(const System& s) {
  const int k = s.k, rows = s.rows;
  for (int i = 0; i < k; ++i) {
    beta[i] = 1.0f / lanes::sqrt(penalty[i]);
    vfloat* z = x.data() + static_cast<size_t>(i) * s.all + s.first;
    for (int r = 0; r < rows; ++r) z[r * s.step] *= beta[i];
  }
  const vfloat *const Z = x.data() + s.first, *const Y = y.data() + s.first;
  batch::gram(Z, s.step, s.all, rows, k, gram_.data());
  for (int r = 0; r < rows; ++r) {
    b_[r] = Y[r * s.step];
    shift_[r] = splat(s.T1);
  }
  // A^-1 d = V^-1/2 (d' - Z^T (Z Z^T + (T - 1) I)^-1 Z d') / (T - 1),   d' = V^-1/2 d
  const auto row = [&](int q) { return gram_.data() + batch::packed(rows + 1 + q, 0); };
  vfloat* const u = responses.data() + static_cast<size_t>(s.first) * k;
  for (int q = 0; q < s.n_responses; ++q) {
    for (int i = 0; i < k; ++i) u[q * k + i] *= beta[i];
    for (int r = 0; r < rows; ++r) {
      row(q)[r] = vfloat{};
      for (int i = 0; i < k; ++i)
        row(q)[r] = fma(Z[static_cast<size_t>(i) * s.all + r * s.step], u[q * k + i], row(q)[r]);
    }
  }
  batch::solve_shifted(gram_.data(), shift_.data(), rows, b_.data(), inverse_.data(), s.n_responses);
  for (int q = 0; q < s.n_responses; ++q) {
    batch::substitute_back(gram_.data(), inverse_.data(), rows, row(q));
    for (int i = 0; i < k; ++i) {
      vfloat left = u[q * k + i];
      for (int r = 0; r < rows; ++r) left = fnma(Z[static_cast<size_t>(i) * s.all + r * s.step], row(q)[r], left);
      u[q * k + i] = left * beta[i] / s.T1;
    }
  }
  for (int i = 0; i < k; ++i) {
    vfloat g = {};
    for (int r = 0; r < rows; ++r) g = fma(Z[static_cast<size_t>(i) * s.all + r * s.step], b_[r], g);
    gamma[i] = g;
    beta[i] *= g;
  }
  if (!s.wants_freedom) return;
  for (int r = s.group_rows; r < rows; ++r) shift_[r] = vfloat{};
  freedom = splat(static_cast<float>(s.group_rows)) -
            batch::inverse_trace(gram_.data(), inverse_.data(), shift_.data(), rows, b_.data());
}

}  // namespace covary
