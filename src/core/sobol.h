// SPDX-License-Identifier: Apache-2.0
// Owen-scrambled Sobol' points whose coordinates are pure functions of an index and a key [Burley2020]. A sequence of
// 2D points takes the first two Sobol' dimensions, of which every aligned run of 2^m points is a (0, m, 2)-net: each
// elementary interval of area 2^-m holds exactly one point. Scrambling preserves this and makes each point uniform, so
// that means are unbiased [Owen1998]. Each key also shuffles the order of the points, so that sequences of different
// keys can be padded into further dimensions of one sample.
#pragma once

#include <cstdint>

namespace covary {

/// Point `index` of the sequence of `key`, which must be well mixed: x in the upper 32 bits, y in the lower, each a
/// fraction of 2^32. The first 2^m points are a net for every m. `reversed_index`: the index with its bits reversed.
uint64_t sobol_point(uint32_t reversed_index, uint64_t key);
/// x alone.
uint32_t sobol_first(uint32_t reversed_index, uint64_t key);

/// The 32 bits reversed.
constexpr uint32_t reverse_bits(uint32_t x) {
  x = __builtin_bswap32(x);
  x = (x & 0x0f0f0f0fu) << 4 | (x >> 4 & 0x0f0f0f0fu);
  x = (x & 0x33333333u) << 2 | (x >> 2 & 0x33333333u);
  return (x & 0x55555555u) << 1 | (x >> 1 & 0x55555555u);
}

}  // namespace covary
