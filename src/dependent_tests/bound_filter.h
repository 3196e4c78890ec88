// SPDX-License-Identifier: Apache-2.0
// The exact minimiser of the error bound of dependent tests ([Csonka2002] Sec. 4), which the paper's own weights
// (region_filter.h) are not. With v_q = sigma_q^2 / N_q, the variance of the mean of the independent samples of pixel
// q,
//
//     eps(f) = 3 sqrt(sum_q f_q^2 v_q) + sum_q f_q Delta_q,   f_q >= 0, sum_q f_q = 1,
//
// has its minimum at
//
//     f_q = (lambda - Delta_q)^+ / v_q / sum_r (lambda - Delta_r)^+ / v_r,   sum_q ((lambda - Delta_q)^+)^2 / v_q = 9,
//
// as in linear estimation with a bound on the bias [SacksYlvisaker1978], [Nazin2007],
// where eps = lambda: one increasing equation in one unknown, solved by Newton's method from above. Pixels may have any
// number of samples, so no classes are needed; windows can be large; and as N grows the filter vanishes except among
// pixels of equal C_d.
#pragma once

#include "dependent_tests/region_filter.h"
#include "filters/filter_input.h"

namespace covary {

/// `window`: side of the square around a pixel, odd, 3 … 63. The centre's sigma is used for all pixels of the window,
/// as in the paper: individual ones would favour pixels whose samples happened to be dark and so to vary little.
/// `difference_scale`: one plane of factors >= 0 for the differences Delta_q of each pixel, or null; kFar restricts a
/// pixel to those of equal C_d. The border of the input must be at least half the window. Bit-identical for any number
/// of threads.
FilteredImage bound_filter(const FilterInput& input, int window, const Planes* difference_scale = nullptr);

}  // namespace covary
