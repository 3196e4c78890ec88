// SPDX-License-Identifier: Apache-2.0
// Vectors of kLanes floats, one lane per pixel, so that per-pixel algebra reads like scalar code. They are compiler
// vectors (GCC, Clang): plain operators, any instruction set. A lane never looks at another one, hence results do not
// depend on which pixels share a vector.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#ifdef __SSE__
#include <xmmintrin.h>
#endif

namespace covary::lanes {

#if defined(__AVX512F__)
inline constexpr int kLanes = 16;
#else
inline constexpr int kLanes = 8;
#endif

typedef float vfloat __attribute__((vector_size(sizeof(float) * kLanes)));
typedef int32_t vint __attribute__((vector_size(sizeof(int32_t) * kLanes)));

inline vfloat splat(float value) { return vfloat{} + value; }
inline vint splat_int(int32_t value) { return vint{} + value; }

/// Loads and stores need no alignment.
inline vfloat load(const float* p) {
  vfloat v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(float* p, vfloat v) { std::memcpy(p, &v, sizeof v); }

inline vint bits(vfloat v) { return reinterpret_cast<vint>(v); }
inline vfloat from_bits(vint v) { return reinterpret_cast<vfloat>(v); }

inline vfloat max(vfloat a, vfloat b) { return a > b ? a : b; }
inline vfloat min(vfloat a, vfloat b) { return a < b ? a : b; }

inline vfloat sqrt(vfloat v) {
  vfloat r;
  for (int l = 0; l < kLanes; ++l) r[l] = std::sqrt(v[l]);
  return r;
}

/// While one lives, results of its thread that are too small for a normal float (below 1.2e-38) are zero. Products of
/// Gaussian weights are often so small, and some processors take a hundred times longer for them.
class FlushTiny {
 public:
#ifdef __SSE__
  FlushTiny() { _mm_setcsr(before_ | kFlushToZero); }
  ~FlushTiny() { _mm_setcsr(before_); }
  FlushTiny(const FlushTiny&) = delete;
  FlushTiny& operator=(const FlushTiny&) = delete;

 private:
  static constexpr unsigned kFlushToZero = 0x8000;
  const unsigned before_ = _mm_getcsr();
#endif
};

/// e^x for x <= 0, relative error below 3e-7 + 1e-7 |x|; 0 below -87.
inline vfloat exp_of_nonpositive(vfloat x) {
  const vfloat t = x * 1.44269504f;
  const vfloat shifted = t + 12582912.0f;        // its last bits are the nearest integer
  const vfloat f = t - (shifted - 12582912.0f);  // in [-1/2, 1/2] where x >= -87
  // Taylor coefficients of 2^f.
  vfloat p = splat(1.53533619e-4f);
  p = p * f + 1.33335581e-3f;
  p = p * f + 9.61812911e-3f;
  p = p * f + 5.55041087e-2f;
  p = p * f + 2.40226507e-1f;
  p = p * f + 6.93147181e-1f;
  p = p * f + 1.0f;
  return x > splat(-87.0f) ? from_bits(bits(p) + (bits(shifted) << 23)) : vfloat{};  // p 2^integer
}

/// Lane l of the result is lane order[l] of a followed by b.
inline vfloat shuffle(vfloat a, vfloat b, vint order) {
#ifdef __clang__
  vfloat result;
  for (int l = 0; l < kLanes; ++l) result[l] = order[l] < kLanes ? a[order[l]] : b[order[l] - kLanes];
  return result;
#else
  return __builtin_shuffle(a, b, order);
#endif
}

/// Transposes a kLanes x kLanes block in place: rows[i][j] <-> rows[j][i].
inline void transpose(vfloat (&rows)[kLanes]) {
  // Swaps the off-diagonal halves of blocks of size 2, 4, 8, …: after the step for `half`, blocks of twice that size
  // are transposed.
  constexpr auto step = []<int half>(vfloat(&r)[kLanes]) {
    vint low, high;
    for (int l = 0; l < kLanes; ++l) {
      low[l] = (l & half) ? kLanes + (l ^ half) : l;
      high[l] = (l & half) ? kLanes + l : (l ^ half);
    }
    for (int i = 0; i < kLanes; ++i) {
      if (i & half) continue;
      const vfloat a = r[i], b = r[i + half];
      r[i] = shuffle(a, b, low);
      r[i + half] = shuffle(a, b, high);
    }
  };
  step.template operator()<1>(rows);
  step.template operator()<2>(rows);
  step.template operator()<4>(rows);
  if constexpr (kLanes == 16) step.template operator()<8>(rows);
}

}  // namespace covary::lanes
