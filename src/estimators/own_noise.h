// SPDX-License-Identifier: Apache-2.0
// How much of its own noise a pixel's result contains: the covariance of F^ of [YM2025] Eq. (7) with the mean h of the
// pixel's own independent samples, which tells the squared error of the result (risk/image_risk.h). With
//
//     A = X^T X + (T - 1) V_h,   beta = A^-1 X^T y,   d beta = -(T - 1) A^-1 dV_h beta,
//
// F^ depends on h through the coefficient of the target (i = 0) and through the penalties. To first order,
//
//     cov(F^_c, h_c) = beta_0 v_c + (T - 1) sum_i u_ic beta_i cov(V_i, h_c),   u_c = A^-1 (g_c - h_c),
//
// c: channel, v: variance of h. The penalty is (1 - s) (e_0 + e_i) T / 2 + s T v_i, summed over channels, with the
// error e_0 = (p - h)^2 by a pilot p in which h has the weight w, so that
//
//     cov(V_i, h_c) = (1 - s) (1 + [i = 0]) E_c + s [i = 0] S_c,
//     E_c = T sum_c' (1 - w) (h_c' - p_c') cov(h_c', h_c),   S_c = T sum_c' cov(v_c', h_c).
//
// Channels share penalties and most of their noise, so the covariances between channels matter (docs/notes/iicv.md).
// All follow from the group means: cov(v_c', h_c) is their third moment. Left out: the target's part of the pilots of
// other pixels, whose sign varies, lower bounds on penalties, and missing light, which many pixels determine.
#pragma once

#include <vector>

#include "film/grouped_image.h"
#include "filters/planes.h"

namespace covary {

/// 3 planes each, without border.
struct OwnChanges {
  Planes errors;     ///< E, for penalties by a pilot; S / 2, for those by sample variances
  Planes variances;  ///< S
};

/// `slope`: 3 planes, (1 - w) (h - p), or null for penalties by sample variances. `groups`: T, of the CRN image.
/// `shared`: penalties are summed over channels; otherwise c' = c.
OwnChanges own_changes(const GroupedImage& independent, const Moments& h, const Planes* slope, int groups, bool shared,
                       const std::vector<unsigned char>& valid);

}  // namespace covary
