// SPDX-License-Identifier: Apache-2.0
// Small dense linear algebra on kLanes systems of the same size at once, one per lane: Gram matrix, Cholesky
// factorisation, solve. Lower triangles are packed by rows: element (i, j), j <= i, is at i (i + 1) / 2 + j.
#pragma once

#include <cstddef>

#include "filters/lanes.h"

namespace covary::batch {

using lanes::vfloat;

constexpr size_t packed(size_t i, size_t j) { return i * (i + 1) / 2 + j; }
constexpr size_t packed_size(size_t n) { return packed(n, 0); }

namespace detail {

// Register tile: kTile x kTile accumulators and kTile operands. Loops over it are unrolled, to keep it in registers.
inline constexpr int kTile = lanes::kLanes == 16 ? 5 : 3;

/// Calls tile.template operator()<N>(i), N = kTile, for rows i, i + N, … from `begin` on, and once more with a smaller
/// N for the remaining rows before `end`, if any.
template <int N = kTile, typename Tile>
inline void for_each_tile(int begin, int end, const Tile& tile) {
  int i = begin;
  for (; i + N <= end; i += N) tile.template operator()<N>(i);
  if constexpr (N > 1)
    if (i < end) for_each_tile<N - 1>(i, end, tile);
}

/// Rows [i0, i0 + NA), columns [j0, j0 + NB) of the Gram matrix, where either i0 >= j0 + NB, or i0 = j0 and NA = NB.
template <int NA, int NB, bool diagonal>
inline void gram_tile(const vfloat* X, ptrdiff_t row, ptrdiff_t sum, int n, int i0, int j0, vfloat* G) {
  const vfloat *A = X + i0 * row, *B = X + j0 * row;
  vfloat c[NA][NB];
#pragma GCC unroll 8
  for (int a = 0; a < NA; ++a)
#pragma GCC unroll 8
    for (int b = 0; b < NB; ++b) c[a][b] = vfloat{};
  for (int s = 0; s < n; ++s) {
    vfloat va[NA], vb[NB];
#pragma GCC unroll 8
    for (int a = 0; a < NA; ++a) va[a] = A[a * row + s * sum];
#pragma GCC unroll 8
    for (int b = 0; b < NB; ++b) {
      vb[b] = B[b * row + s * sum];
      lanes::keep_in_register(vb[b]);
    }
#pragma GCC unroll 8
    for (int a = 0; a < NA; ++a)
#pragma GCC unroll 8
      for (int b = 0; b < NB; ++b)
        if (!diagonal || b <= a) c[a][b] = lanes::fma(va[a], vb[b], c[a][b]);
  }
#pragma GCC unroll 8
  for (int a = 0; a < NA; ++a)
#pragma GCC unroll 8
    for (int b = 0; b < NB; ++b)
      if (!diagonal || b <= a) G[packed(i0 + a, j0 + b)] = c[a][b];
}

}  // namespace detail

/// Lower triangle of the m x m matrix of inner products of m vectors of length n; element s of vector i is at X[i * row
/// + s * sum].
inline void gram(const vfloat* X, ptrdiff_t row, ptrdiff_t sum, int m, int n, vfloat* G) {
  using namespace detail;
  for_each_tile(0, m, [&]<int NA>(int i) {
    for_each_tile(0, i, [&]<int NB>(int j) { gram_tile<NA, NB, false>(X, row, sum, n, i, j, G); });
    gram_tile<NA, NA, true>(X, row, sum, n, i, i, G);
  });
}

/// products[i] = sum over s < n of X[i * row + s * sum] * y[s * sum], for m vectors.
inline void multiply(const vfloat* X, ptrdiff_t row, ptrdiff_t sum, const vfloat* y, int m, int n, vfloat* products) {
  detail::for_each_tile<4>(0, m, [&]<int N>(int i) {
    vfloat sums[2][N];
#pragma GCC unroll 8
    for (int a = 0; a < N; ++a) sums[0][a] = sums[1][a] = vfloat{};
    const auto add = [&](int s, int parity) {
      vfloat factor = y[s * sum];
      lanes::keep_in_register(factor);
#pragma GCC unroll 8
      for (int a = 0; a < N; ++a) sums[parity][a] = lanes::fma(X[(i + a) * row + s * sum], factor, sums[parity][a]);
    };
    int s = 0;
    for (; s + 1 < n; s += 2) add(s, 0), add(s + 1, 1);
    if (s < n) add(s, 0);
#pragma GCC unroll 8
    for (int a = 0; a < N; ++a) products[i + a] = sums[0][a] + sums[1][a];
  });
}

/// Sum over s < n of (y[s * sum] - sum over i < m of gamma[i] X[i * row + s * sum])^2.
inline vfloat residual_squares(const vfloat* X, ptrdiff_t row, ptrdiff_t sum, const vfloat* y, const vfloat* gamma,
                               int m, int n) {
  vfloat squares = {};
  detail::for_each_tile<6>(0, n, [&]<int N>(int s) {
    vfloat rest[N];
#pragma GCC unroll 8
    for (int a = 0; a < N; ++a) rest[a] = y[(s + a) * sum];
    for (int i = 0; i < m; ++i) {
      vfloat factor = gamma[i];
      lanes::keep_in_register(factor);
#pragma GCC unroll 8
      for (int a = 0; a < N; ++a) rest[a] = lanes::fnma(factor, X[i * row + (s + a) * sum], rest[a]);
    }
#pragma GCC unroll 8
    for (int a = 0; a < N; ++a) squares = lanes::fma(rest[a], rest[a], squares);
  });
  return squares;
}

namespace detail {

/// Rows [i0, i0 + NA), columns [j0, j0 + NB), after subtracting columns before j0 of the Cholesky factor.
template <int NA, int NB, bool diagonal>
inline void subtract_columns(const vfloat* G, int i0, int j0, vfloat (&c)[NA][NB]) {
  const vfloat *A[NA], *B[NB];
#pragma GCC unroll 8
  for (int a = 0; a < NA; ++a) A[a] = G + packed(i0 + a, 0);
#pragma GCC unroll 8
  for (int b = 0; b < NB; ++b) B[b] = G + packed(j0 + b, 0);
#pragma GCC unroll 8
  for (int a = 0; a < NA; ++a)
#pragma GCC unroll 8
    for (int b = 0; b < NB; ++b)
      if (!diagonal || b <= a) c[a][b] = A[a][j0 + b];
  for (int q = 0; q < j0; ++q) {
    vfloat va[NA], vb[NB];
#pragma GCC unroll 8
    for (int a = 0; a < NA; ++a) va[a] = A[a][q];
#pragma GCC unroll 8
    for (int b = 0; b < NB; ++b) {
      vb[b] = B[b][q];
      lanes::keep_in_register(vb[b]);
    }
#pragma GCC unroll 8
    for (int a = 0; a < NA; ++a)
#pragma GCC unroll 8
      for (int b = 0; b < NB; ++b)
        if (!diagonal || b <= a) c[a][b] = lanes::fnma(va[a], vb[b], c[a][b]);
  }
}

/// Columns [j0, j0 + NB) of the factor, given those before: the diagonal block, whose inverted pivots go to `inverse`.
template <int NB>
inline void factor_diagonal(vfloat* G, const vfloat* shift, int j0, vfloat* inverse) {
  vfloat c[NB][NB];
  subtract_columns<NB, NB, true>(G, j0, j0, c);
#pragma GCC unroll 8
  for (int b = 0; b < NB; ++b) {
    vfloat pivot = c[b][b] + shift[j0 + b];
#pragma GCC unroll 8
    for (int p = 0; p < b; ++p) pivot = lanes::fnma(c[b][p], c[b][p], pivot);
    const vfloat inverted = 1.0f / lanes::sqrt(lanes::max(pivot, shift[j0 + b]));
    inverse[j0 + b] = inverted;
#pragma GCC unroll 8
    for (int a = b + 1; a < NB; ++a) {
#pragma GCC unroll 8
      for (int p = 0; p < b; ++p) c[a][b] = lanes::fnma(c[a][p], c[b][p], c[a][b]);
      c[a][b] *= inverted;
      G[packed(j0 + a, j0 + b)] = c[a][b];
    }
  }
}

/// Rows [i0, i0 + NA) of the same columns, below the diagonal block.
template <int NA, int NB>
inline void factor_rows(vfloat* G, int i0, int j0, const vfloat* inverse) {
  vfloat c[NA][NB];
  subtract_columns<NA, NB, false>(G, i0, j0, c);
#pragma GCC unroll 8
  for (int b = 0; b < NB; ++b)
#pragma GCC unroll 8
    for (int a = 0; a < NA; ++a) {
#pragma GCC unroll 8
      for (int p = 0; p < b; ++p) c[a][b] = lanes::fnma(c[a][p], G[packed(j0 + b, j0 + p)], c[a][b]);
      c[a][b] *= inverse[j0 + b];
      G[packed(i0 + a, j0 + b)] = c[a][b];
    }
}

}  // namespace detail

/// x = L^-T x, by columns of L^T, that is, by rows of L. `L`, `inverse`: as left by solve_shifted.
inline void substitute_back(const vfloat* L, const vfloat* inverse, int m, vfloat* x) {
  for (int j = m - 1; j >= 0; --j) {
    const vfloat* const Lj = L + packed(j, 0);
    x[j] *= inverse[j];
    for (int q = 0; q < j; ++q) x[q] = lanes::fnma(Lj[q], x[j], x[q]);
  }
}

/// Solves (G + diag(shift)) x = b for positive semidefinite G and m positive shifts. `G`: packed, m rows, with room for
/// 1 + n_more further rows; on return it holds, below the diagonal, the Cholesky factor L. `bx`: b on entry, x on
/// return. `inverse`: receives the inverses of the m diagonal elements of L. In exact arithmetic no pivot is below its
/// shift; rounding is prevented from violating that. `n_more` right-hand sides b' in the first m elements of rows m +
/// 1, … are replaced by L^-1 b'.
inline void solve_shifted(vfloat* G, const vfloat* shift, int m, vfloat* bx, vfloat* inverse, int n_more = 0) {
  using namespace detail;
  // b is appended as row m, which then holds L^-1 b.
  vfloat* const last = G + packed(m, 0);
  for (int j = 0; j < m; ++j) last[j] = bx[j];
  const int n_rows = m + 1 + n_more;
  for_each_tile(0, m, [&]<int NB>(int j0) {
    factor_diagonal<NB>(G, shift, j0, inverse);
    for_each_tile(j0 + NB, n_rows, [&]<int NA>(int i0) { factor_rows<NA, NB>(G, i0, j0, inverse); });
  });
  for (int j = 0; j < m; ++j) bx[j] = last[j];
  substitute_back(G, inverse, m, bx);
}

namespace detail {

/// Sums of squares of columns [j0, j0 + N) of L^-1, by simultaneous forward substitution. `columns`: scratch for N m
/// vectors.
template <int N>
inline void inverse_squares(const vfloat* L, const vfloat* inverse, int m, int j0, vfloat* columns,
                            vfloat (&squares)[N]) {
  vfloat total[N] = {};
  for (int i = j0; i < m; ++i) {
    const vfloat* const Li = L + packed(i, 0);
    vfloat* const row = columns + static_cast<ptrdiff_t>(i) * N;
    // Terms with q - j of equal parity are summed together; columns are zero above the diagonal.
    vfloat sums[2][N] = {};
    int q = j0;
    for (; q + 1 < i; q += 2) {
      vfloat first = Li[q], second = Li[q + 1];
      lanes::keep_in_register(first);
      lanes::keep_in_register(second);
#pragma GCC unroll 8
      for (int c = 0; c < N; ++c) {
        sums[c % 2][c] = lanes::fma(first, columns[q * N + c], sums[c % 2][c]);
        sums[1 - c % 2][c] = lanes::fma(second, columns[(q + 1) * N + c], sums[1 - c % 2][c]);
      }
    }
    if (q < i)
#pragma GCC unroll 8
      for (int c = 0; c < N; ++c) sums[c % 2][c] = lanes::fma(Li[q], columns[q * N + c], sums[c % 2][c]);
#pragma GCC unroll 8
    for (int c = 0; c < N; ++c) {
      vfloat element = -(sums[0][c] + sums[1][c]) * inverse[i];
      if (i == j0 + c) element = inverse[i];
      if (i < j0 + c) element = vfloat{};
      row[c] = element;
      total[c] = lanes::fma(element, element, total[c]);
    }
  }
#pragma GCC unroll 8
  for (int c = 0; c < N; ++c) squares[c] = total[c];
}

}  // namespace detail

/// Columns of an inverse factor computed at once.
inline constexpr int kColumnsAtOnce = 4;

/// Sum of weight_i (A^-1)_ii for A = G + diag(shift), from the results of solve_shifted. `columns`: scratch for
/// kColumnsAtOnce m vectors.
inline vfloat inverse_trace(const vfloat* L, const vfloat* inverse, const vfloat* weight, int m, vfloat* columns) {
  // A^-1 = L^-T L^-1
  vfloat trace = {};
  int j = 0;
  for (; j + kColumnsAtOnce <= m; j += kColumnsAtOnce) {
    vfloat squares[kColumnsAtOnce];
    detail::inverse_squares<kColumnsAtOnce>(L, inverse, m, j, columns, squares);
    for (int c = 0; c < kColumnsAtOnce; ++c) trace = lanes::fma(weight[j + c], squares[c], trace);
  }
  for (; j < m; ++j) {
    vfloat squares[1];
    detail::inverse_squares<1>(L, inverse, m, j, columns, squares);
    trace = lanes::fma(weight[j], squares[0], trace);
  }
  return trace;
}

}  // namespace covary::batch
