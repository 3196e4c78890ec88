// SPDX-License-Identifier: Apache-2.0
// Vectors of kLanes floats, one lane per pixel, so that per-pixel algebra reads like scalar code. Compiler vector
// extensions (GCC, Clang): plain operators, any instruction set. Lanes never interact, so results do not depend on
// which pixels share a vector. Products and sums are fused only where the code says so (fma()): what a compiler chooses
// to fuse depends on what else a function computes.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

#if defined(__AVX512F__) || defined(__FMA__)
#include <immintrin.h>
#elif defined(__SSE__)
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

/// Unaligned loads and stores.
inline vfloat load(const float* p) {
  vfloat v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(float* p, vfloat v) { std::memcpy(p, &v, sizeof v); }

/// Keeps v in a register. Compilers tend to reload it from memory for each use, which makes the uses wait for loads.
inline void keep_in_register([[maybe_unused]] vfloat& v) {
#if defined(__AVX512F__) || defined(__AVX__)
  asm("" : "+v"(v));
#endif
}

/// a b + c and c - a b, rounded once if the processor has such instructions.
#if defined(__AVX512F__)
inline vfloat fma(vfloat a, vfloat b, vfloat c) { return _mm512_fmadd_ps(a, b, c); }
inline vfloat fnma(vfloat a, vfloat b, vfloat c) { return _mm512_fnmadd_ps(a, b, c); }
#elif defined(__FMA__)
inline vfloat fma(vfloat a, vfloat b, vfloat c) { return _mm256_fmadd_ps(a, b, c); }
inline vfloat fnma(vfloat a, vfloat b, vfloat c) { return _mm256_fnmadd_ps(a, b, c); }
#else
inline vfloat fma(vfloat a, vfloat b, vfloat c) { return a * b + c; }
inline vfloat fnma(vfloat a, vfloat b, vfloat c) { return c - a * b; }
#endif

inline vfloat squared_length(vfloat x, vfloat y, vfloat z) { return fma(x, x, fma(y, y, z * z)); }

inline vint bits(vfloat v) { return reinterpret_cast<vint>(v); }
inline vfloat from_bits(vint v) { return reinterpret_cast<vfloat>(v); }

/// a > b ? a : b and a < b ? a : b, which compilers turn into slower comparisons and blends.
#ifdef __AVX512F__
inline constexpr __mmask16 kAll = 0xffff;  // masked intrinsics with all lanes set, because of GCC bug 105593
inline vfloat max(vfloat a, vfloat b) { return _mm512_maskz_max_ps(kAll, a, b); }
inline vfloat min(vfloat a, vfloat b) { return _mm512_maskz_min_ps(kAll, a, b); }
#else
inline vfloat max(vfloat a, vfloat b) { return a > b ? a : b; }
inline vfloat min(vfloat a, vfloat b) { return a < b ? a : b; }
#endif

/// Whether any bit is set.
inline bool any(vint v) {
  typedef int64_t Words __attribute__((vector_size(sizeof v)));
  const Words words = reinterpret_cast<Words>(v);
  int64_t all = 0;
  for (int i = 0; i < kLanes / 2; ++i) all |= words[i];
  return all != 0;
}

inline vfloat sqrt(vfloat v) {
  vfloat r;
  for (int l = 0; l < kLanes; ++l) r[l] = std::sqrt(v[l]);
  return r;
}

/// 1 / v for v from 1e-37 to 1e37, relative error below 2e-7.
inline vfloat reciprocal(vfloat v) {
#ifdef __AVX512F__
  const vfloat r = _mm512_maskz_rcp14_ps(kAll, v);
  return fma(r, fnma(v, r, splat(1)), r);
#else
  return 1 / v;
#endif
}

/// While an object exists, results in its thread too small for a normal float (below 1.2e-38) become zero. Products of
/// Gaussian weights are often that small, and some processors take a hundred times longer for denormals.
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

inline constexpr float kLog2E = 1.44269504f;

/// 2^x for x <= 0, relative error below 2e-7; 0 below -126, and for NaN.
inline vfloat exp2_of_nonpositive(vfloat x) {
  // 2^x = 2^f 2^n with f in [-1/2, 1/2]. Minimax polynomial (relative error) with p(0) = 1.
  const auto of_fraction = [](vfloat f) {
    vfloat p = splat(1.32647273e-3f);
    p = fma(p, f, splat(9.67151299e-3f));
    p = fma(p, f, splat(5.55073358e-2f));
    p = fma(p, f, splat(2.40222424e-1f));
    p = fma(p, f, splat(6.93147004e-1f));
    return fma(p, f, splat(1.0f));
  };
#ifdef __AVX512F__
  x = max(x, splat(-200.0f));
  const vfloat n = _mm512_maskz_roundscale_ps(kAll, x, _MM_FROUND_TO_NEAREST_INT);
  return _mm512_maskz_scalef_ps(kAll, of_fraction(x - n), n);
#else
  const vfloat shifted = x + 12582912.0f;  // its low bits are the nearest integer
  const vfloat p = of_fraction(x - (shifted - 12582912.0f));
  return x > splat(-126.0f) ? from_bits(bits(p) + (bits(shifted) << 23)) : vfloat{};
#endif
}

/// e^x for x <= 0, relative error below 3e-7 + 1e-7 |x|; 0 below -88.
inline vfloat exp_of_nonpositive(vfloat x) { return exp2_of_nonpositive(x * kLog2E); }

/// Lane l of the result is lane order[l] of the concatenation of a and b.
inline vfloat shuffle(vfloat a, vfloat b, vint order) {
#ifdef __clang__
  vfloat result;
  for (int l = 0; l < kLanes; ++l) result[l] = order[l] < kLanes ? a[order[l]] : b[order[l] - kLanes];
  return result;
#else
  return __builtin_shuffle(a, b, order);
#endif
}

/// Lane l of the result is lane l + n of the concatenation of a and b.
template <int n>
inline vfloat shift(vfloat a, vfloat b) {
  vint order;
  for (int l = 0; l < kLanes; ++l) order[l] = l + n;
  return shuffle(a, b, order);
}

namespace detail {

/// For each block of four lanes: a0 b0 a1 b1, or a2 b2 a3 b3.
template <bool high>
inline vfloat interleave(vfloat a, vfloat b) {
  vint order;
  for (int l = 0; l < kLanes; ++l) order[l] = (l & ~3) + (high ? 2 : 0) + (l & 3) / 2 + (l % 2) * kLanes;
  return shuffle(a, b, order);
}

/// For each block of four lanes: a0 a1 b0 b1, or a2 a3 b2 b3.
template <bool high>
inline vfloat interleave_pairs(vfloat a, vfloat b) {
  vint order;
  for (int l = 0; l < kLanes; ++l) order[l] = (l & ~3) + (high ? 2 : 0) + l % 2 + (l & 2) / 2 * kLanes;
  return shuffle(a, b, order);
}

/// Blocks of four lanes: blocks `first` and `second` of a, then those of b.
template <int first, int second>
inline vfloat select_blocks(vfloat a, vfloat b) {
  vint order;
  constexpr int kHalf = kLanes / 2;
  for (int l = 0; l < kLanes; ++l) order[l] = 4 * (l % kHalf < 4 ? first : second) + l % 4 + (l < kHalf ? 0 : kLanes);
  return shuffle(a, b, order);
}

}  // namespace detail

/// Transposes a kLanes x kLanes block in place: rows[i][j] <-> rows[j][i].
[[gnu::always_inline]] inline void transpose(vfloat (&rows)[kLanes]) {
  using namespace detail;
  // Transpose within each 4 x 4 block.
  for (int i = 0; i < kLanes; i += 4) {
    const vfloat a = interleave<false>(rows[i], rows[i + 1]), b = interleave<true>(rows[i], rows[i + 1]);
    const vfloat c = interleave<false>(rows[i + 2], rows[i + 3]), d = interleave<true>(rows[i + 2], rows[i + 3]);
    rows[i] = interleave_pairs<false>(a, c), rows[i + 1] = interleave_pairs<true>(a, c);
    rows[i + 2] = interleave_pairs<false>(b, d), rows[i + 3] = interleave_pairs<true>(b, d);
  }
  // Then transpose the blocks.
  for (int i = 0; i < 4; ++i) {
    if constexpr (kLanes == 16) {
      const vfloat a = select_blocks<0, 1>(rows[i], rows[i + 4]), b = select_blocks<2, 3>(rows[i], rows[i + 4]);
      const vfloat c = select_blocks<0, 1>(rows[i + 8], rows[i + 12]),
                   d = select_blocks<2, 3>(rows[i + 8], rows[i + 12]);
      rows[i] = select_blocks<0, 2>(a, c), rows[i + 4] = select_blocks<1, 3>(a, c);
      rows[i + 8] = select_blocks<0, 2>(b, d), rows[i + 12] = select_blocks<1, 3>(b, d);
    } else {
      const vfloat a = rows[i], b = rows[i + 4];
      rows[i] = select_blocks<0, 0>(a, b), rows[i + 4] = select_blocks<1, 1>(a, b);
    }
  }
}

}  // namespace covary::lanes
