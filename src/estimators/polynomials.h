// SPDX-License-Identifier: Apache-2.0
// Control variates that are polynomials in the random numbers of a pixel's samples. Salaun et al. 2022 [Salaun2022].
// For comparison ([YM2025] Fig. 10); it needs individual samples, so it runs inside a render.
//
// For one pixel, f_s are the values of n samples and m_i(u) the monomials of total degree 1 and 2 in the first d random
// numbers u in [0, 1)^d of a sample. With f, m_i the means over the samples and M_i the integral of m_i,
//
//     F^ = f - sum_i beta_i (m_i - M_i),   beta: ordinary least squares with an intercept, per channel.
//
// The residuals of such a fit sum to zero, so f = a + sum_i beta_i m_i with the intercept a, and F^ is the integral of
// the fitted polynomial. It depends only on the space of polynomials, not on the basis. Ours consists of products of
// Legendre polynomials on [0, 1], orthonormal, which keeps the normal equations well-conditioned; all M_i are zero.
//
// It uses no groups, and pixels are independent: counts may differ between pixels if each has enough samples.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/spectrum.h"

namespace covary {

class Settings;
struct Method;

struct PolynomialsOptions {
  static constexpr int kMaxDimensions = 6;
  /// d; default 4, 1 … kMaxDimensions.
  int dimensions = 4;
  /// n: samples of each pixel, more than n_coefficients(); required.
  uint32_t samples = 0;

  /// Coefficients of the fit, including the intercept: (d + 1) (d + 2) / 2.
  int n_coefficients() const { return (dimensions + 1) * (dimensions + 2) / 2; }
  std::vector<std::string> validate() const;
};

/// Estimate of one pixel. `values`: n samples, finite; `coordinates`: n x d numbers in [0, 1), [sample][dimension].
/// Computes in double precision; does not allocate. Throws Error(kUsage) if n or d is out of range or the array sizes
/// do not match.
///
/// Consistent for independent samples with uniform coordinates; biased by O(1/n), because the coefficients are fitted
/// to the samples they are applied to; unbiased for integrands that are such polynomials. The result can be negative
/// even if all samples are positive. Equal values give exactly that value. If the coordinates do not determine the
/// coefficients (all in a plane, say), the estimate is the mean of the samples.
Spectrum polynomials(std::span<const Spectrum> values, std::span<const float> coordinates, int dimensions);

inline constexpr const char* kPolynomials = "polynomials";
/// The estimator `polynomials` with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_polynomials(Settings& options);

}  // namespace covary
