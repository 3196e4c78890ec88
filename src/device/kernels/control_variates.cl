// SPDX-License-Identifier: Apache-2.0
// Image-space control variates, [YM2025] Eq. (7) with the coefficients of Eq. (10), and their error, Eq. (8): a work
// group of LANES items for each pixel. estimators/control_variates.h and .cpp, whose names and steps these are; with
// fewer rows than neighbours, the dual form (find_coefficients).
//
// Definitions, beside those of records (pixel_record.h): K; HAS_ERROR (of h), otherwise a ridge; SYMMETRIC penalties;
// STD_ERROR.
// Compiled: GROUPS=12 WEIGHTS_DIFFER=0 CONDITION=0 SHARED=1 K=25 HAS_ERROR=1 SYMMETRIC=1 STD_ERROR=0
// Compiled: GROUPS=12 WEIGHTS_DIFFER=0 CONDITION=1 SHARED=1 K=25 HAS_ERROR=1 SYMMETRIC=1 STD_ERROR=1
// Compiled: GROUPS=12 WEIGHTS_DIFFER=0 CONDITION=1 SHARED=0 K=25 HAS_ERROR=0 SYMMETRIC=0 STD_ERROR=1
#define LANES 32
#include "portable.h"
#include "pixel_record.h"
#include "small_systems.h"

#define USELESS 1e30f
#define SMALLEST_PENALTY 1e-4f
#define NEGLIGIBLE_RIDGE 1e-5f
#define FEWEST_FREEDOM 0.1f

// A system: channels `first` … first + CHANNELS - 1. Row r of it is element r * STEP + first of a record.
#define CHANNELS (SHARED ? 3 : 1)
#define STEP (SHARED ? 1 : 3)
#define ALL_ROWS (CONTRASTS / STEP)
#define GROUP_ROWS (GROUP_CONTRASTS / STEP)
#define PRIMAL (K <= ALL_ROWS)
// The matrix: element r of neighbour i. Inner products are those of the neighbours (and the target, neighbour K), or,
// in the dual form, those of the rows.
#define ORDER (PRIMAL ? K : ALL_ROWS)
#define VECTORS (PRIMAL ? K + 1 : ALL_ROWS)
#define X_STRIDE PADDED(VECTORS)
#define X_AT(i, r) X[PRIMAL ? (r) * X_STRIDE + (i) : (i) * X_STRIDE + (r)]
#define X_SIZE (X_STRIDE * (PRIMAL ? ALL_ROWS : K + 1))
// Right-hand sides: the target, and, in the primal form, the rows of the mean constraint, for the degrees of freedom.
#define MORE (PRIMAL && STD_ERROR ? ALL_ROWS - GROUP_ROWS : 0)
#define FACTOR_ROWS (ORDER + 1 + MORE)
#define FACTOR_PITCH PITCH(FACTOR_ROWS > X_STRIDE ? FACTOR_ROWS : X_STRIDE)
#define TAIL (SIZE - CONTRASTS)
#define TAIL_AT(element, i) tail[((element) - CONTRASTS) * (K + 1) + (i)]

typedef struct {
  float sample_fraction, mean_constraint, ridge;
} Weights;

FUNCTION float penalty_of(LOCAL const float* tail, int element, int first, int i) {
  return TAIL_AT(element + (SHARED ? 0 : first), i);
}

// Reads the records of the K neighbours, and of the target as the last of them; `at`: their pixels, -1 outside.
FUNCTION void gather(GLOBAL const float* records, LOCAL const int* at, int first, LOCAL float* X, LOCAL float* tail) {
  for (int i = 0; i <= K; ++i) {
    const int pixel = at[i];
    GLOBAL const float* record = records + (size_t)(pixel < 0 ? 0 : pixel) * STRIDE;
    for (int e = get_local_id(0); e < SIZE; e += LANES) {
      const float outside = e >= ERROR_OF_H && e < GROUP_VARIANCE ? (SHARED ? 3 * USELESS : USELESS) : 0.0f;
      const float value = pixel < 0 ? outside : record[e];
      if (e >= CONTRASTS)
        TAIL_AT(e, i) = value;
      else if (SHARED || e % 3 == first)
        X_AT(i, e / STEP) = value;
    }
  }
  // Vectors that fill up the last block of inner products.
  for (int e = get_local_id(0); e < (X_STRIDE - VECTORS) * (PRIMAL ? ALL_ROWS : K); e += LANES) {
    const int v = VECTORS + e % max(X_STRIDE - VECTORS, 1), s = e / max(X_STRIDE - VECTORS, 1);
    X[s * X_STRIDE + v] = 0.0f;
  }
}

#if CONDITION
// The rows of the mean constraint, scaled by sqrt(mean_constraint (T - 1) S / N).
FUNCTION void scale_condition(const Weights* weights, int first, LOCAL float* X, LOCAL const float* tail,
                              LOCAL float* scratch) {
  float S = 0.0f, N = 0.0f;
  for (int i = get_local_id(0); i < K; i += LANES) {
    S += penalty_of(tail, GROUP_VARIANCE, first, i);
    for (int c = 0; c < CHANNELS; ++c) {
      const float missing = TAIL_AT(MISSING_LIGHT + first + c, i), g = X_AT(i, GROUP_ROWS + c);
      S = fma((float)GROUPS * missing, missing, S);
      N = fma(g, g, N);
    }
  }
  S = group_sum(S, scratch);
  N = group_sum(N, scratch);
  const float factor = sqrt(S / fmax(N, 1e-30f) * (weights->mean_constraint * (float)(GROUPS - 1)));
  for (int i = get_local_id(0); i <= K; i += LANES)
    for (int c = 0; c < CHANNELS; ++c) X_AT(i, GROUP_ROWS + c) *= factor;
}
#endif

// V_h,i of [YM2025] Eq. (10), summed over the channels of the system.
FUNCTION void find_penalties(const Weights* weights, int first, LOCAL const float* X, LOCAL const float* tail,
                             LOCAL float* penalty, LOCAL float* scratch) {
#if HAS_ERROR
  const float own = penalty_of(tail, ERROR_OF_H, first, K);
#else
  float sum = 0.0f;
  for (int i = get_local_id(0); i < K; i += LANES) sum += penalty_of(tail, GROUP_VARIANCE, first, i);
  const float homogeneous =
      group_sum(sum, scratch) * (weights->ridge > 0.0f ? weights->ridge : NEGLIGIBLE_RIDGE) / (float)K;
#endif
  for (int i = get_local_id(0); i < K; i += LANES) {
    float smallest = 0.0f;
#if HAS_ERROR
    const float error = penalty_of(tail, ERROR_OF_H, first, i);
    float value = SYMMETRIC ? 0.5f * (own + error) : error;  // [YM2025] Sec. 4, after Eq. (11)
    if (weights->sample_fraction > 0.0f) {
      float variance = 0.0f;
      for (int c = 0; c < CHANNELS; ++c) variance += TAIL_AT(H_VARIANCE + first + c, i);
      value = (1.0f - weights->sample_fraction) * value + weights->sample_fraction * (float)GROUPS * variance;
    }
    smallest = SMALLEST_PENALTY * penalty_of(tail, GROUP_VARIANCE, first, i);
#else
    const float value = homogeneous;
#endif
#if CONDITION
    float squares = 0.0f;
    for (int c = 0; c < CHANNELS; ++c) squares = fma(X_AT(i, GROUP_ROWS + c), X_AT(i, GROUP_ROWS + c), squares);
    smallest = fmax(smallest, squares * (SMALLEST_PENALTY / (weights->mean_constraint * (float)(GROUPS - 1))));
#endif
    penalty[i] = fmax(value, smallest) + 1e-30f;
  }
}

// Solves Eq. (10), as
//   beta = (X^T X + (T - 1) V_h)^-1 X^T y
// or, with fewer rows than neighbours, with Z = X V_h^-1/2, as
//   V_h^1/2 beta = gamma = Z^T (Z Z^T + (T - 1) I)^-1 y.
// On return, gamma holds the coefficients of the matrix in X: X, or Z in the second case. Returns the degrees of freedom
// of the fit as a fraction of those of the groups. `shift`, `solution`, `inverse`: PADDED(ORDER) floats.
FUNCTION float find_coefficients(LOCAL float* X, LOCAL float* A, LOCAL const float* penalty, LOCAL float* beta,
                                 LOCAL float* gamma, LOCAL float* shift, LOCAL float* solution, LOCAL float* inverse,
                                 LOCAL float* scratch) {
  const int lane = get_local_id(0);
  const float T1 = (float)(GROUPS - 1);
  group_barrier();
#if !PRIMAL
  for (int i = lane; i < K; i += LANES) {
    const float scale = 1.0f / sqrt(penalty[i]);
    beta[i] = scale;
    for (int r = 0; r < ALL_ROWS; ++r) X_AT(i, r) *= scale;
  }
  group_barrier();
#endif
  for (int j = lane; j < PADDED(ORDER); j += LANES) shift[j] = PRIMAL && j < K ? T1 * penalty[j] : T1;
  gram(X, X_STRIDE, VECTORS, PRIMAL ? ALL_ROWS : K, A, FACTOR_PITCH);
  group_barrier();
  for (int j = lane; j < PADDED(ORDER); j += LANES)
    for (int more = 0; more <= MORE; ++more)
      if (!PRIMAL)
        A[j * FACTOR_PITCH + ORDER] = j < ORDER ? X_AT(K, j) : 0.0f;
      else if (more > 0)
        A[j * FACTOR_PITCH + K + more] = j < K ? X_AT(j, GROUP_ROWS + more - 1) : 0.0f;
  factor(A, FACTOR_PITCH, shift, ORDER, FACTOR_ROWS, inverse);
  for (int j = lane; j < PADDED(ORDER); j += LANES) solution[j] = j < ORDER ? A[j * FACTOR_PITCH + ORDER] : 0.0f;
  substitute_back(A, FACTOR_PITCH, inverse, ORDER, solution);
  for (int i = lane; i < K; i += LANES) {
#if PRIMAL
    beta[i] = gamma[i] = solution[i];
#else
    float g = 0.0f;
    for (int r = 0; r < ALL_ROWS; ++r) g = fma(X_AT(i, r), solution[r], g);
    gamma[i] = g;
    beta[i] *= g;
#endif
  }
  float freedom = 0.0f;
#if STD_ERROR
  group_barrier();
  if (!PRIMAL)
    for (int r = GROUP_ROWS + lane; r < ALL_ROWS; r += LANES) shift[r] = 0.0f;
  freedom = (float)(PRIMAL ? K : GROUP_ROWS);
  float norm = 0.0f;
  for (int e = lane; e < MORE * K; e += LANES) {
    const float element = A[e % K * FACTOR_PITCH + K + 1 + e / K];
    norm = fma(element, element, norm);
  }
  freedom -= group_sum(norm, scratch);
  freedom -= inverse_trace(A, FACTOR_PITCH, inverse, shift, ORDER, scratch);
#endif
  group_barrier();
  return freedom / (float)((GROUPS - 1) * CHANNELS);
}

// Eq. (8), the squared standard error of channel c, which is channel c - first of the system. Its first three terms are
// the variance of f - sum_i beta_i g_i, whose residuals are corrected by the degrees of freedom [GHW1979]; the last is
// sum_i beta_i^2 var h_i.
FUNCTION float squared_error(const Weights* weights, int c, int first, LOCAL const float* X, LOCAL const float* tail,
                             LOCAL const float* beta, LOCAL const float* gamma, float freedom, LOCAL float* scratch) {
  const int lane = get_local_id(0);
  float residuals = 0.0f;
  for (int row = lane; row < GROUP_ROWS / CHANNELS; row += LANES) {
    const int r = row * CHANNELS + (c - first);
    float rest = X_AT(K, r);
    for (int i = 0; i < K; ++i) rest = fma(-gamma[i], X_AT(i, r), rest);
    residuals = fma(rest, rest, residuals);
  }
  float missing = lane == 0 ? TAIL_AT(MISSING_LIGHT + c, K) : 0.0f;
  float own = 0.0f, variances = 0.0f, squares = 0.0f, count = 0.0f;
  for (int i = lane; i < K; i += LANES) {
    const float variance = TAIL_AT(H_VARIANCE + c, i);
    missing = fma(-beta[i], TAIL_AT(MISSING_LIGHT + c, i), missing);
    own = fma(beta[i] * beta[i], variance, own);
    squares = fma(beta[i], beta[i], squares);
    variances += variance;
    count += beta[i] != 0.0f ? 1.0f : 0.0f;  // pixels outside the frame have no coefficient
  }
  residuals = group_sum(residuals, scratch), missing = group_sum(missing, scratch);
  own = group_sum(own, scratch), variances = group_sum(variances, scratch);
  squares = group_sum(squares, scratch), count = group_sum(count, scratch);
  const float left = fmax(1.0f - freedom, FEWEST_FREEDOM), fraction = weights->sample_fraction;
  const float of_crn = residuals / ((float)(GROUPS * (GROUPS - 1)) * left * left) + missing * missing;
  return of_crn + ((1.0f - fraction) * own + fraction * squares * variances / fmax(count, 1.0f));
}

// `chosen`, `offsets`: of nearest.cl. `guide`, `other`: of pair_moments.cl. A work group for each pixel. Results: three
// floats a pixel.
KERNEL control_variates(GLOBAL const float* RESTRICT records, GLOBAL const float* RESTRICT guide,
                        GLOBAL const float* RESTRICT other, GLOBAL const ushort* RESTRICT chosen,
                        GLOBAL const int* RESTRICT offsets, int width, int height, float sample_fraction,
                        float mean_constraint, float ridge, GLOBAL float* RESTRICT estimate,
                        GLOBAL float* RESTRICT std_error) {
  LOCAL_ARRAY(float, X, X_SIZE);
  LOCAL_ARRAY(float, A, PADDED(VECTORS) * FACTOR_PITCH);
  LOCAL_ARRAY(float, tail, TAIL*(K + 1));
  LOCAL_ARRAY(float, penalty, K);
  LOCAL_ARRAY(float, beta, K);
  LOCAL_ARRAY(float, gamma, K);
  LOCAL_ARRAY(float, shift, PADDED(ORDER));
  LOCAL_ARRAY(float, solution, PADDED(ORDER));
  LOCAL_ARRAY(float, inverse, PADDED(ORDER));
  LOCAL_ARRAY(float, scratch, LANES);
  LOCAL_ARRAY(int, at, K + 1);
  Weights weights;
  weights.sample_fraction = sample_fraction, weights.mean_constraint = mean_constraint, weights.ridge = ridge;
  const int x = get_group_id(0), y = get_group_id(1), lane = get_local_id(0), pixel = y * width + x;
  for (int i = lane; i <= K; i += LANES) {
    const int o = i < K ? chosen[(size_t)i * width * height + pixel] : 0;
    const int qx = x + offsets[2 * o], qy = y + offsets[2 * o + 1];
    at[i] = qx >= 0 && qy >= 0 && qx < width && qy < height ? qy * width + qx : -1;
  }
  for (int first = 0; first < 3; first += CHANNELS) {
    group_barrier();
    gather(records, at, first, X, tail);
    group_barrier();
#if CONDITION
    scale_condition(&weights, first, X, tail, scratch);
    group_barrier();
#endif
    find_penalties(&weights, first, X, tail, penalty, scratch);
    const float freedom = find_coefficients(X, A, penalty, beta, gamma, shift, solution, inverse, scratch);
    for (int c = first; c < first + CHANNELS; ++c) {
      float change = 0.0f;
      for (int i = lane; i < K; i += LANES) change = fma(-beta[i], TAIL_AT(DIFFERENCE + c, i), change);
      change = group_sum(change, scratch);
#if STD_ERROR
      const float error = sqrt(squared_error(&weights, c, first, X, tail, beta, gamma, freedom, scratch));
#endif
      if (lane > 0) continue;
      // Squares of values above 10^18 overflow; such pixels take the independent image.
      const float value = guide[4 * (size_t)pixel + c] + (1.0f + PLANTED_BUG * 0.01f) * change;
      estimate[3 * (size_t)pixel + c] = isfinite(value) ? value : other[4 * (size_t)pixel + c];
#if STD_ERROR
      std_error[3 * (size_t)pixel + c] = isfinite(error) ? error : sqrt(TAIL_AT(H_VARIANCE + c, K));
#endif
    }
  }
}
