// SPDX-License-Identifier: Apache-2.0
// Small dense linear algebra for kLanes systems of the same size at once, one per lane: Gram matrix, Cholesky
// factorisation, solve. Lower triangles are packed by rows: element (i, j), j <= i, at i (i + 1) / 2 + j.
#pragma once

#include <cstddef>

#include "filters/lanes.h"

namespace covary::batch {

using lanes::vfloat;

constexpr size_t packed(size_t i, size_t j) { return i * (i + 1) / 2 + j; }
constexpr size_t packed_size(size_t n) { return packed(n, 0); }

namespace detail {

// Register tile: NA x NB accumulators. 16 with 32 vector registers, 8 otherwise.
inline constexpr int kTileRows = 4;
inline constexpr int kTileColumns = lanes::kLanes == 16 ? 4 : 2;

/// c(a, b) = sum over s < n of A[a * row + s * sum] * B[b * row + s * sum].
template <int NA, int NB>
inline void product_tile(const vfloat* A, const vfloat* B, ptrdiff_t row, ptrdiff_t sum, int n, vfloat (&c)[NA][NB]) {
  for (int a = 0; a < NA; ++a)
    for (int b = 0; b < NB; ++b) c[a][b] = vfloat{};
  for (int s = 0; s < n; ++s) {
    vfloat va[NA], vb[NB];
    for (int a = 0; a < NA; ++a) va[a] = A[a * row + s * sum];
    for (int b = 0; b < NB; ++b) vb[b] = B[b * row + s * sum];
    for (int a = 0; a < NA; ++a)
      for (int b = 0; b < NB; ++b) c[a][b] += va[a] * vb[b];
  }
}

template <int NA, int NB>
inline void gram_tile(const vfloat* X, ptrdiff_t row, ptrdiff_t sum, int n, int i0, int j0, vfloat* G) {
  vfloat c[NA][NB];
  product_tile<NA, NB>(X + i0 * row, X + j0 * row, row, sum, n, c);
  for (int a = 0; a < NA; ++a)
    for (int b = 0; b < NB; ++b)
      if (j0 + b <= i0 + a) G[packed(i0 + a, j0 + b)] = c[a][b];
}

template <int NA>
inline void gram_tile(int nb, const vfloat* X, ptrdiff_t row, ptrdiff_t sum, int n, int i0, int j0, vfloat* G) {
  if (nb == 1) return gram_tile<NA, 1>(X, row, sum, n, i0, j0, G);
  if (nb == 2) return gram_tile<NA, 2>(X, row, sum, n, i0, j0, G);
  if constexpr (kTileColumns > 2) {
    if (nb == 3) return gram_tile<NA, 3>(X, row, sum, n, i0, j0, G);
    if (nb == 4) return gram_tile<NA, 4>(X, row, sum, n, i0, j0, G);
  }
}

}  // namespace detail

/// Lower triangle of the m x m matrix of inner products of m vectors of length n; element s of vector i lies at
/// X[i * row + s * sum].
inline void gram(const vfloat* X, ptrdiff_t row, ptrdiff_t sum, int m, int n, vfloat* G) {
  using namespace detail;
  for (int i = 0; i < m; i += kTileRows) {
    const int na = std::min(kTileRows, m - i), last = i + na - 1;
    for (int j = 0; j <= last; j += kTileColumns) {
      const int nb = std::min(kTileColumns, m - j);
      switch (na) {
        case 1:
          gram_tile<1>(nb, X, row, sum, n, i, j, G);
          break;
        case 2:
          gram_tile<2>(nb, X, row, sum, n, i, j, G);
          break;
        case 3:
          gram_tile<3>(nb, X, row, sum, n, i, j, G);
          break;
        default:
          gram_tile<4>(nb, X, row, sum, n, i, j, G);
          break;
      }
    }
  }
}

namespace detail {

/// What columns before j0 of the Cholesky factor leave of rows [i0, i0 + NA), columns [j0, j0 + NB).
template <int NA, int NB>
inline void subtract_columns(const vfloat* G, int i0, int j0, vfloat (&c)[NA][NB]) {
  const vfloat *A[NA], *B[NB];
  for (int a = 0; a < NA; ++a) A[a] = G + packed(i0 + a, 0);
  for (int b = 0; b < NB; ++b) B[b] = G + packed(j0 + b, 0);
  for (int a = 0; a < NA; ++a)
    for (int b = 0; b < NB; ++b) c[a][b] = j0 + b <= i0 + a ? A[a][j0 + b] : vfloat{};
  for (int q = 0; q < j0; ++q) {
    vfloat va[NA], vb[NB];
    for (int a = 0; a < NA; ++a) va[a] = A[a][q];
    for (int b = 0; b < NB; ++b) vb[b] = B[b][q];
    for (int a = 0; a < NA; ++a)
      for (int b = 0; b < NB; ++b) c[a][b] -= va[a] * vb[b];
  }
}

/// Columns [j0, j0 + NB) of the factor, those before being known: first the block on the diagonal, whose pivots are
/// inverted into `inverse`, then the rows below it, to row m.
template <int NB>
inline void factor_diagonal(vfloat* G, const vfloat* shift, int j0, vfloat* inverse) {
  vfloat c[NB][NB];
  subtract_columns<NB, NB>(G, j0, j0, c);
  for (int b = 0; b < NB; ++b) {
    vfloat pivot = c[b][b] + shift[j0 + b];
    for (int p = 0; p < b; ++p) pivot -= c[b][p] * c[b][p];
    inverse[j0 + b] = 1.0f / lanes::sqrt(lanes::max(pivot, shift[j0 + b]));
    for (int a = b + 1; a < NB; ++a) {
      for (int p = 0; p < b; ++p) c[a][b] -= c[a][p] * c[b][p];
      c[a][b] *= inverse[j0 + b];
      G[packed(j0 + a, j0 + b)] = c[a][b];
    }
  }
}

template <int NA, int NB>
inline void factor_rows(vfloat* G, int i0, int j0, const vfloat* inverse) {
  vfloat c[NA][NB];
  subtract_columns<NA, NB>(G, i0, j0, c);
  for (int b = 0; b < NB; ++b)
    for (int a = 0; a < NA; ++a) {
      for (int p = 0; p < b; ++p) c[a][b] -= c[a][p] * G[packed(j0 + b, j0 + p)];
      c[a][b] *= inverse[j0 + b];
      G[packed(i0 + a, j0 + b)] = c[a][b];
    }
}

template <int NB>
inline void factor_columns(vfloat* G, const vfloat* shift, int m, int j0, vfloat* inverse) {
  factor_diagonal<NB>(G, shift, j0, inverse);
  int i = j0 + NB;
  for (; i + kTileRows <= m + 1; i += kTileRows) factor_rows<kTileRows, NB>(G, i, j0, inverse);
  for (; i <= m; ++i) factor_rows<1, NB>(G, i, j0, inverse);
}

}  // namespace detail

/// Solves (G + diag(shift)) x = b for positive semidefinite G and m positive shifts. `G`: packed, m rows, with room for
/// one more row; on return it holds, below the diagonal, the Cholesky factor L. `bx`: b on entry, x on return.
/// `inverse`: receives the inverses of the m diagonal elements of L. In exact arithmetic no pivot is below its shift;
/// rounding is kept from going there.
inline void solve_shifted(vfloat* G, const vfloat* shift, int m, vfloat* bx, vfloat* inverse) {
  using namespace detail;
  // b is carried along as row m, which then holds L^-1 b.
  vfloat* const last = G + packed(m, 0);
  for (int j = 0; j < m; ++j) last[j] = bx[j];
  int j0 = 0;
  for (; j0 + kTileColumns <= m; j0 += kTileColumns) factor_columns<kTileColumns>(G, shift, m, j0, inverse);
  for (; j0 < m; ++j0) factor_columns<1>(G, shift, m, j0, inverse);
  // Back substitution by columns of L^T, that is by rows of L.
  for (int j = 0; j < m; ++j) bx[j] = last[j];
  for (int j = m - 1; j >= 0; --j) {
    const vfloat* const Lj = G + packed(j, 0);
    bx[j] *= inverse[j];
    for (int q = 0; q < j; ++q) bx[q] -= Lj[q] * bx[j];
  }
}

/// Sum of weight_i (A^-1)_ii for A = G + diag(shift), from what solve_shifted leaves. `column`: scratch for m vectors.
inline vfloat inverse_trace(const vfloat* L, const vfloat* inverse, const vfloat* weight, int m, vfloat* column) {
  // A^-1 = L^-T L^-1; column j of L^-1 by forward substitution.
  vfloat trace = {};
  for (int j = 0; j < m; ++j) {
    column[j] = inverse[j];
    vfloat squares = inverse[j] * inverse[j];
    for (int i = j + 1; i < m; ++i) {
      const vfloat* const Li = L + packed(i, 0);
      vfloat even = {}, odd = {};
      int q = j;
      for (; q + 1 < i; q += 2) {
        even += Li[q] * column[q];
        odd += Li[q + 1] * column[q + 1];
      }
      if (q < i) even += Li[q] * column[q];
      column[i] = -(even + odd) * inverse[i];
      squares += column[i] * column[i];
    }
    trace += weight[j] * squares;
  }
  return trace;
}

/// b^T A^-1 b likewise; b is destroyed.
inline vfloat inverse_norm(const vfloat* L, const vfloat* inverse, int m, vfloat* b) {
  vfloat norm = {};
  for (int i = 0; i < m; ++i) {
    const vfloat* const Li = L + packed(i, 0);
    vfloat rest = b[i];
    for (int q = 0; q < i; ++q) rest -= Li[q] * b[q];
    b[i] = rest * inverse[i];
    norm += b[i] * b[i];
  }
  return norm;
}

}  // namespace covary::batch
