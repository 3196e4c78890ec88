// SPDX-License-Identifier: Apache-2.0
// Small dense linear algebra for kLanes systems of the same size at once, one per lane: Gram matrix, Cholesky
// factorisation, solve. Lower triangles are packed by rows: element (i, j), j <= i, at i (i + 1) / 2 + j.
#pragma once

#include <cstddef>

#include "estimators/lanes.h"

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

/// Solves (G + shift I) x = b for positive semidefinite G and shift > 0. `G`: packed, m rows, with room for one more row;
/// destroyed. `bx`: b on entry, x on return. `inverse`: scratch for m vectors. In exact arithmetic no pivot is below
/// `shift`; rounding is kept from going there.
inline void solve_shifted(vfloat* G, vfloat shift, int m, vfloat* bx, vfloat* inverse) {
  // b is carried along as row m, which then holds L^-1 b.
  vfloat* const last = G + packed(m, 0);
  for (int j = 0; j < m; ++j) last[j] = bx[j];

  for (int j = 0; j < m; ++j) {
    const vfloat* const Lj = G + packed(j, 0);
    vfloat pivot = Lj[j] + shift, odd = {};
    int p = 0;
    for (; p + 1 < j; p += 2) {
      pivot -= Lj[p] * Lj[p];
      odd += Lj[p + 1] * Lj[p + 1];
    }
    if (p < j) pivot -= Lj[p] * Lj[p];
    inverse[j] = 1.0f / lanes::sqrt(lanes::max(pivot - odd, shift));

    int i = j + 1;
    for (; i + 3 <= m; i += 4) {
      vfloat *L0 = G + packed(i, 0), *L1 = G + packed(i + 1, 0), *L2 = G + packed(i + 2, 0), *L3 = G + packed(i + 3, 0);
      vfloat c0 = L0[j], c1 = L1[j], c2 = L2[j], c3 = L3[j];
      for (int q = 0; q < j; ++q) {
        const vfloat l = Lj[q];
        c0 -= L0[q] * l;
        c1 -= L1[q] * l;
        c2 -= L2[q] * l;
        c3 -= L3[q] * l;
      }
      L0[j] = c0 * inverse[j];
      L1[j] = c1 * inverse[j];
      L2[j] = c2 * inverse[j];
      L3[j] = c3 * inverse[j];
    }
    for (; i <= m; ++i) {
      vfloat* Li = G + packed(i, 0);
      vfloat c = Li[j];
      for (int q = 0; q < j; ++q) c -= Li[q] * Lj[q];
      Li[j] = c * inverse[j];
    }
  }
  // Back substitution by columns of L^T, that is by rows of L.
  for (int j = 0; j < m; ++j) bx[j] = last[j];
  for (int j = m - 1; j >= 0; --j) {
    const vfloat* const Lj = G + packed(j, 0);
    bx[j] *= inverse[j];
    for (int q = 0; q < j; ++q) bx[q] -= Lj[q] * bx[j];
  }
}

}  // namespace covary::batch
