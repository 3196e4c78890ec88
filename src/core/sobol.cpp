// SPDX-License-Identifier: Apache-2.0
#include "core/sobol.h"

#include "core/random.h"

namespace covary {
namespace {

/// As reverse_bits(), for 64 bits.
uint64_t reverse_bits_64(uint64_t x) {
  x = __builtin_bswap64(x);
  x = (x & 0x0f0f0f0f0f0f0f0full) << 4 | (x >> 4 & 0x0f0f0f0f0f0f0f0full);
  x = (x & 0x3333333333333333ull) << 2 | (x >> 2 & 0x3333333333333333ull);
  return (x & 0x5555555555555555ull) << 1 | (x >> 1 & 0x5555555555555555ull);
}

/// A random permutation in which each bit depends only on itself and lower bits [LaineKarras2011]; with bits reversed,
/// an Owen scramble. Operations and constants of [Vegdahl2021], which mix better than the original ones.
uint32_t permute_upwards(uint32_t x, uint32_t seed) {
  x ^= x * 0x3d20adeau;
  x += seed;
  x *= (seed >> 16) | 1u;
  x ^= x * 0x05526c56u;
  return x ^ (x * 0x53a22864u);
}

/// Sobol's second coordinate with its bits reversed. Its generator matrix is Pascal's triangle modulo 2: reading the
/// bits as coefficients of a polynomial p(x) over GF(2), the result is p(1 + x), computed by halves [Ahmed2024].
uint32_t pascal_product(uint32_t bits) {
  bits ^= bits >> 16 & 0x0000ffffu;
  bits ^= bits >> 8 & 0x00ff00ffu;
  bits ^= bits >> 4 & 0x0f0f0f0fu;
  bits ^= bits >> 2 & 0x33333333u;
  return bits ^ (bits >> 1 & 0x55555555u);
}

/// [Burley2020] Listing 3: shuffles the order of the points.
uint32_t shuffled(uint32_t reversed_index, uint64_t key) {
  return reverse_bits(permute_upwards(reversed_index, static_cast<uint32_t>(key)));
}
/// The coordinates with their bits reversed; before scrambling, the first is the index itself.
uint32_t reversed_x(uint32_t index, uint64_t key) { return permute_upwards(index, static_cast<uint32_t>(key >> 32)); }
uint32_t reversed_y(uint32_t index, uint64_t key) {
  return permute_upwards(pascal_product(index), static_cast<uint32_t>(mix64(key)));
}

}  // namespace

uint64_t sobol_point(uint32_t reversed_index, uint64_t key) {
  const uint32_t index = shuffled(reversed_index, key);
  return reverse_bits_64(uint64_t{reversed_y(index, key)} << 32 | reversed_x(index, key));
}

uint32_t sobol_first(uint32_t reversed_index, uint64_t key) {
  return reverse_bits(reversed_x(shuffled(reversed_index, key), key));
}

}  // namespace covary
