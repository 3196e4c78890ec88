// SPDX-License-Identifier: Apache-2.0
// Polynomial control variates as their formula is written: raw monomials and their integrals over the unit cube, least
// squares with an intercept by a rank-revealing QR factorisation, in double precision, without regard for speed.
#pragma once

#include <Eigen/Dense>
#include <array>
#include <span>
#include <vector>

#include "core/spectrum.h"

namespace covary::reference {

/// Exponents of all monomials of total degree 1 and 2.
inline std::vector<std::vector<int>> monomials(int dimensions) {
  std::vector<std::vector<int>> result;
  for (int i = 0; i < dimensions; ++i) {
    std::vector<int> exponents(dimensions, 0);
    exponents[i] = 1;
    result.push_back(exponents);
    for (int j = i; j < dimensions; ++j) {
      std::vector<int> product(dimensions, 0);
      ++product[i], ++product[j];
      result.push_back(product);
    }
  }
  return result;
}

inline double monomial(const std::vector<int>& exponents, const float* u) {
  double value = 1;
  for (size_t i = 0; i < exponents.size(); ++i)
    for (int e = 0; e < exponents[i]; ++e) value *= u[i];
  return value;
}

/// Integral of a monomial over [0, 1]^d.
inline double integral(const std::vector<int>& exponents) {
  double value = 1;
  for (int e : exponents) value /= e + 1;
  return value;
}

inline std::array<double, 3> polynomials(std::span<const Spectrum> values, std::span<const float> coordinates,
                                         int dimensions) {
  const std::vector<std::vector<int>> terms = monomials(dimensions);
  const auto n = static_cast<Eigen::Index>(values.size()), n_terms = static_cast<Eigen::Index>(terms.size());
  Eigen::MatrixXd design(n, n_terms + 1), f(n, 3);
  for (Eigen::Index s = 0; s < n; ++s) {
    design(s, n_terms) = 1;
    for (Eigen::Index i = 0; i < n_terms; ++i) design(s, i) = monomial(terms[i], coordinates.data() + s * dimensions);
    f.row(s) << values[s].r, values[s].g, values[s].b;
  }
  const Eigen::MatrixXd beta = design.colPivHouseholderQr().solve(f);
  Eigen::RowVectorXd estimate = f.colwise().mean();
  for (Eigen::Index i = 0; i < n_terms; ++i) estimate -= beta.row(i) * (design.col(i).mean() - integral(terms[i]));
  return {estimate[0], estimate[1], estimate[2]};
}

}  // namespace covary::reference
