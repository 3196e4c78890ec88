// SPDX-License-Identifier: Apache-2.0
// The coefficients of control variates, [YM2025] Eq. (10), for kLanes pixels at a time (control_variates.h): penalised
// least squares.
#pragma once

#include <vector>

#include "filters/lanes.h"

namespace covary {

/// Sizes of the systems, and what is wanted of them beside the coefficients.
struct FitShape {
  int k = 0;                     ///< neighbours
  int contrasts = 0;             ///< of the groups in all channels, and the rows of the mean constraint
  int group_contrasts = 0;       ///< those of the groups alone
  int groups = 0;                ///< T
  bool shared = true;            ///< one system for all channels
  bool wants_freedom = false;    ///< the degrees of freedom
  bool wants_responses = false;  ///< solutions for further right-hand sides
};

/// Scratch memory of one thread, with the systems and their solutions.
struct PenalisedFit {
  std::vector<lanes::vfloat> x;          ///< [neighbour][contrast]
  std::vector<lanes::vfloat> y;          ///< [contrast]
  std::vector<lanes::vfloat> penalty;    ///< [neighbour] V_h
  std::vector<lanes::vfloat> beta;       ///< [neighbour]
  std::vector<lanes::vfloat> gamma;      ///< coefficients of the matrix that find_coefficients() leaves in x
  std::vector<lanes::vfloat> responses;  ///< [channel][neighbour]
  /// Degrees of freedom of the fit, trace(X (X^T X + (T - 1) V_h)^-1 X^T), as a fraction of those of the groups.
  lanes::vfloat freedom = {};

  void prepare(const FitShape& shape);
  /// Solves Eq. (10) for the channels [first, first + count), as
  ///   beta = (X^T X + (T - 1) V_h)^-1 X^T y
  /// or, with fewer rows than neighbours, with Z = X V_h^-1/2, as
  ///   V_h^1/2 beta = gamma = Z^T (Z Z^T + (T - 1) I)^-1 y,
  /// where Z replaces X. `responses`: the vectors d of these channels are replaced by (X^T X + (T - 1) V_h)^-1 d.
  void find_coefficients(const FitShape& shape, int first, int count);

 private:
  struct System;
  void solve(const System& system);
  void solve_dual(const System& system);

  std::vector<lanes::vfloat> gram_, shift_, inverse_, b_;
};

}  // namespace covary
