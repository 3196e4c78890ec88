// SPDX-License-Identifier: Apache-2.0
// Control variates that are polynomials in the random numbers of a pixel's samples. Salaun et al. 2022 [Salaun2022]. A
// comparator ([YM2025] Fig. 10); it needs the samples themselves, so it works inside a render.
//
// For one pixel, f_s are the values of n samples and m_i(u) the monomials of total degree 1 and 2 in the first d
// numbers u in [0, 1)^d that a sample was made of. With f, m_i the means over the samples and M_i the integral of m_i,
//
//     F^ = f - sum_i beta_i (m_i - M_i),   beta: ordinary least squares with an intercept, per channel.
//
// The residuals of such a fit add up to zero, so f = a + sum_i beta_i m_i with the intercept a, and F^ is the integral
// of the fitted polynomial. That depends on the space of polynomials alone and not on its basis. Ours is of products of
// Legendre polynomials on [0, 1], orthonormal, which keeps the normal equations well-conditioned; all M_i are zero.
//
// It has no groups, and every pixel stands alone: counts may differ between pixels where each has enough samples.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/spectrum.h"

namespace covary {

class Settings;
struct Estimator;

struct PolynomialsOptions {
  static constexpr int kMaxDimensions = 6;
  /// d; default 4, 1 … kMaxDimensions.
  int dimensions = 4;
  /// n: samples of each pixel, more than n_coefficients(); required.
  uint32_t samples = 0;

  /// Coefficients of the fit, the intercept included: (d + 1) (d + 2) / 2.
  int n_coefficients() const { return (dimensions + 1) * (dimensions + 2) / 2; }
  std::vector<std::string> validate() const;
};

/// The estimate of one pixel. `values`: n samples, finite; `coordinates`: n x d numbers in [0, 1), [sample][dimension].
/// Works in double precision; allocates nothing. Throws Error(kUsage) where n or d is out of range or the arrays do not
/// fit.
///
/// Claim: consistent, for independent samples with uniform coordinates; biased by O(1/n), because the coefficients are
/// fitted to the samples they are applied to; unbiased for integrands that are such polynomials. The result can be
/// negative where all samples are positive. Equal values give that value exactly. Where the coordinates do not
/// determine the coefficients (all in a plane, say) the estimate is the mean of the samples.
Spectrum polynomials(std::span<const Spectrum> values, std::span<const float> coordinates, int dimensions);

/// The estimator `polynomials` with these options. Throws Error(kUsage) that lists everything that is wrong with them.
Estimator make_polynomials(Settings& options);

}  // namespace covary
