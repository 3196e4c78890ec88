// SPDX-License-Identifier: Apache-2.0
// Dense algebra of one small system by one work group of LANES items, in its local memory: filters/batch_algebra.h for
// devices. Sums have a fixed order.
//
// A matrix is stored by columns, `pitch` floats apart: element (i, j) is at j * pitch + i. The factor L fills the part
// below the diagonal. Above it, at i * pitch + j, lies element (i, j) of L^-1, once inverse_squares() has found it.
// Sizes are constants; the pitch is a multiple of 4, but not of 8, so that rows of vectors lie in different banks.
#define PADDED(n) (((n) + 3) / 4 * 4)
#define PITCH(n) (PADDED(n) % 8 == 0 ? PADDED(n) + 4 : PADDED(n))

// The sum of the items' values, the same in all of them. `scratch`: LANES floats.
FUNCTION float group_sum(float value, LOCAL float* scratch) {
  group_barrier();
  scratch[get_local_id(0)] = value;
  group_barrier();
  float sum = 0.0f;
  for (int l = 0; l < LANES; ++l) sum += scratch[l];
  return sum;
}

FUNCTION float4 load4(LOCAL const float* p) { return vload4(0, p); }

// Inner products of m vectors of n elements; element s of vector v is at X[s * stride + v], zero for v from m to
// PADDED(m). Fills columns 0 … PADDED(m) - 1 of A, rows below PADDED(m), from the diagonal blocks down. An item takes
// 4 x 4 products at a time.
FUNCTION void gram(LOCAL const float* X, int stride, int m, int n, LOCAL float* A, int pitch) {
  const int blocks = PADDED(m) / 4, tiles = blocks * (blocks + 1) / 2;
  for (int tile = get_local_id(0); tile < tiles; tile += LANES) {
    int i = 0, first = 0;  // block row i has i + 1 tiles, from the tile `first` on
    while (first + i < tile) first += ++i;
    const int j = tile - first;
    float4 c0 = FLOAT4(0.0f, 0.0f, 0.0f, 0.0f), c1 = c0, c2 = c0, c3 = c0;
    for (int s = 0; s < n; ++s) {
      const float4 a = load4(X + s * stride + 4 * i), b = load4(X + s * stride + 4 * j);
      c0.x = fma(a.x, b.x, c0.x), c0.y = fma(a.y, b.x, c0.y), c0.z = fma(a.z, b.x, c0.z), c0.w = fma(a.w, b.x, c0.w);
      c1.x = fma(a.x, b.y, c1.x), c1.y = fma(a.y, b.y, c1.y), c1.z = fma(a.z, b.y, c1.z), c1.w = fma(a.w, b.y, c1.w);
      c2.x = fma(a.x, b.z, c2.x), c2.y = fma(a.y, b.z, c2.y), c2.z = fma(a.z, b.z, c2.z), c2.w = fma(a.w, b.z, c2.w);
      c3.x = fma(a.x, b.w, c3.x), c3.y = fma(a.y, b.w, c3.y), c3.z = fma(a.z, b.w, c3.z), c3.w = fma(a.w, b.w, c3.w);
    }
    LOCAL float* const to = A + 4 * j * pitch + 4 * i;
    vstore4(c0, 0, to), vstore4(c1, 0, to + pitch), vstore4(c2, 0, to + 2 * pitch), vstore4(c3, 0, to + 3 * pitch);
  }
}

// Rows of the panel of columns j0 … j0 + 3, after subtracting what the columns before it contribute.
FUNCTION void subtract_columns(LOCAL float* A, int pitch, int j0, int rows) {
  for (int i = j0 + get_local_id(0); i < rows; i += LANES) {
    LOCAL float* const to = A + j0 * pitch + i;
    float c0 = to[0], c1 = to[pitch], c2 = to[2 * pitch], c3 = to[3 * pitch];
    for (int q = 0; q < j0; ++q) {
      const float l = -A[q * pitch + i];
      const float4 b = load4(A + q * pitch + j0);
      c0 = fma(l, b.x, c0), c1 = fma(l, b.y, c1), c2 = fma(l, b.z, c2), c3 = fma(l, b.w, c3);
    }
    to[0] = c0, to[pitch] = c1, to[2 * pitch] = c2, to[3 * pitch] = c3;
  }
}

FUNCTION float inverse_pivot(float pivot, float shift) { return 1.0f / sqrt(fmax(pivot, shift)); }

// The Cholesky factor L of A + diag(shift), m columns. Rows m … rows - 1 hold right-hand sides b and become L^-1 b.
// `inverse`: the inverses of the diagonal of L. In exact arithmetic no pivot is below its shift; rounding is prevented
// from violating that. `shift`: PADDED(m) values, positive.
FUNCTION void factor(LOCAL float* A, int pitch, LOCAL const float* shift, int m, int rows, LOCAL float* inverse) {
  for (int j0 = 0; j0 < m; j0 += 4) {
    group_barrier();
    subtract_columns(A, pitch, j0, rows);
    group_barrier();
    // Every item factors the diagonal block by itself.
    LOCAL float* const D = A + j0 * pitch + j0;
    const float s0 = shift[j0], s1 = shift[j0 + 1], s2 = shift[j0 + 2], s3 = shift[j0 + 3];
    const float i0 = inverse_pivot(D[0] + s0, s0);
    const float l10 = D[1] * i0, l20 = D[2] * i0, l30 = D[3] * i0;
    const float i1 = inverse_pivot(fma(-l10, l10, D[pitch + 1] + s1), s1);
    const float l21 = fma(-l20, l10, D[pitch + 2]) * i1, l31 = fma(-l30, l10, D[pitch + 3]) * i1;
    const float i2 = inverse_pivot(fma(-l21, l21, fma(-l20, l20, D[2 * pitch + 2] + s2)), s2);
    const float l32 = fma(-l31, l21, fma(-l30, l20, D[2 * pitch + 3])) * i2;
    const float i3 = inverse_pivot(fma(-l32, l32, fma(-l31, l31, fma(-l30, l30, D[3 * pitch + 3] + s3))), s3);
    for (int i = j0 + 4 + get_local_id(0); i < rows; i += LANES) {
      LOCAL float* const to = A + j0 * pitch + i;
      const float x0 = to[0] * i0;
      const float x1 = fma(-x0, l10, to[pitch]) * i1;
      const float x2 = fma(-x1, l21, fma(-x0, l20, to[2 * pitch])) * i2;
      const float x3 = fma(-x2, l32, fma(-x1, l31, fma(-x0, l30, to[3 * pitch]))) * i3;
      to[0] = x0, to[pitch] = x1, to[2 * pitch] = x2, to[3 * pitch] = x3;
    }
    group_barrier();
    if (get_local_id(0) == 0) {
      inverse[j0] = i0, inverse[j0 + 1] = i1, inverse[j0 + 2] = i2, inverse[j0 + 3] = i3;
      D[1] = l10, D[2] = l20, D[3] = l30;
      D[pitch + 2] = l21, D[pitch + 3] = l31, D[2 * pitch + 3] = l32;
    }
  }
  group_barrier();
}

// x = L^-T x. `x`: PADDED(m) values, zero from m on.
FUNCTION void substitute_back(LOCAL const float* A, int pitch, LOCAL const float* inverse, int m, LOCAL float* x) {
  for (int j0 = PADDED(m) - 4; j0 >= 0; j0 -= 4) {
    group_barrier();
    LOCAL const float* const D = A + j0 * pitch + j0;
    const float x3 = x[j0 + 3] * (j0 + 3 < m ? inverse[j0 + 3] : 0.0f);
    const float x2 = (j0 + 2 < m ? fma(-D[2 * pitch + 3], x3, x[j0 + 2]) * inverse[j0 + 2] : 0.0f);
    const float x1 = (j0 + 1 < m ? fma(-D[pitch + 2], x2, fma(-D[pitch + 3], x3, x[j0 + 1])) * inverse[j0 + 1] : 0.0f);
    const float x0 = fma(-D[1], x1, fma(-D[2], x2, fma(-D[3], x3, x[j0]))) * inverse[j0];
    for (int q = get_local_id(0); q < j0; q += LANES) {
      const float4 l = load4(A + q * pitch + j0);
      x[q] = fma(-l.x, x0, fma(-l.y, x1, fma(-l.z, x2, fma(-l.w, x3, x[q]))));
    }
    group_barrier();
    if (get_local_id(0) == 0) x[j0] = x0, x[j0 + 1] = x1, x[j0 + 2] = x2, x[j0 + 3] = x3;
  }
  group_barrier();
}

// Sum of weight_j (A^-1)_jj, from the results of factor(): A^-1 = L^-T L^-1, and an item finds a column of L^-1 by
// forward substitution.
FUNCTION float inverse_trace(LOCAL float* A, int pitch, LOCAL const float* inverse, LOCAL const float* weight, int m,
                             LOCAL float* scratch) {
  float trace = 0.0f;
  for (int j = get_local_id(0); j < m; j += LANES) {
    float squares = 0.0f;
    for (int i0 = j / 4 * 4; i0 < m; i0 += 4) {
      float4 s = FLOAT4(0.0f, 0.0f, 0.0f, 0.0f);
      for (int q = j; q < i0; ++q) {
        const float e = q == j ? inverse[j] : A[q * pitch + j];
        const float4 l = load4(A + q * pitch + i0);
        s.x = fma(l.x, e, s.x), s.y = fma(l.y, e, s.y), s.z = fma(l.z, e, s.z), s.w = fma(l.w, e, s.w);
      }
      // Element i of the column is 0 above the diagonal, the inverse pivot on it, and -(sum) / L_ii below.
      LOCAL const float* const D = A + i0 * pitch + i0;
      const float e0 = i0 == j ? inverse[i0] : -s.x * inverse[i0];
      float e1 = 0.0f, e2 = 0.0f, e3 = 0.0f;
      const float before = i0 < j ? 0.0f : e0;
      if (i0 + 1 < m)
        e1 = i0 + 1 == j  ? inverse[i0 + 1]
             : i0 + 1 < j ? 0.0f
                          : -fma(D[1], before, s.y) * inverse[i0 + 1];
      if (i0 + 2 < m)
        e2 = i0 + 2 == j  ? inverse[i0 + 2]
             : i0 + 2 < j ? 0.0f
                          : -fma(D[pitch + 2], e1, fma(D[2], before, s.z)) * inverse[i0 + 2];
      if (i0 + 3 < m)
        e3 = i0 + 3 == j
                 ? inverse[i0 + 3]
                 : -fma(D[2 * pitch + 3], e2, fma(D[pitch + 3], e1, fma(D[3], before, s.w))) * inverse[i0 + 3];
      squares = fma(before, before, squares);
      squares = fma(e1, e1, squares), squares = fma(e2, e2, squares), squares = fma(e3, e3, squares);
      if (i0 > j) A[i0 * pitch + j] = before;
      if (i0 + 1 > j && i0 + 1 < m) A[(i0 + 1) * pitch + j] = e1;
      if (i0 + 2 > j && i0 + 2 < m) A[(i0 + 2) * pitch + j] = e2;
      if (i0 + 3 > j && i0 + 3 < m) A[(i0 + 3) * pitch + j] = e3;
    }
    trace = fma(weight[j], squares, trace);
  }
  return group_sum(trace, scratch);
}
