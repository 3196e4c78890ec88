// SPDX-License-Identifier: Apache-2.0
#include "filters/neighbours.h"

#include <bit>
#include <span>

#include "core/error.h"

namespace covary {

using namespace lanes;

NeighbourSearch::NeighbourSearch(int k, int window) : k_(k), offsets_(window_offsets(window)) {
  COVARY_CHECK(k >= 1 && k <= static_cast<int>(offsets_.size()), "neighbours: k does not fit the window");
  index_mask_ = static_cast<int>(std::bit_ceil(offsets_.size())) - 1;
}

namespace {

/// Smallest and largest key. The smallest ignores key 0, which is mostly the target's own, with distance zero.
struct KeyRange {
  vint smallest, largest;
};

/// A key is the squared distance with the candidate's index in its lowest bits. Non-negative floats compare like their
/// bit patterns, so keys are distinct integers in the desired order.
KeyRange make_keys(const Planes& guide, int x, int y, std::span<const Offset> offsets, int index_mask, vint* keys) {
  const vfloat f0 = load(guide.row(0, y) + x), f1 = load(guide.row(1, y) + x), f2 = load(guide.row(2, y) + x);
  KeyRange range{splat_int(INT32_MAX), splat_int(0)};
  const float* const here = guide.row(0, y) + x;
  const ptrdiff_t stride = guide.stride(), plane = guide.row(1, 0) - guide.row(0, 0);
  for (int j = 0; j < static_cast<int>(offsets.size()); ++j) {
    const float* const there = here + (offsets[j].dy * stride + offsets[j].dx);
    const vfloat d0 = load(there) - f0, d1 = load(there + plane) - f1, d2 = load(there + 2 * plane) - f2;
    const vint key = (bits(squared_length(d0, d1, d2)) & ~index_mask) | j;
    keys[j] = key;
    if (j > 0) range.smallest = key < range.smallest ? key : range.smallest;
    range.largest = key > range.largest ? key : range.largest;
  }
  return range;
}

/// Number of the n keys at or below `threshold`.
vint count_below(const vint* keys, int n, vint threshold) {
  vint even = {}, odd = {};
  int j = 0;
  for (; j + 3 < n; j += 4) {
    even = keys[j] <= threshold ? even + 1 : even;
    odd = keys[j + 1] <= threshold ? odd + 1 : odd;
    even = keys[j + 2] <= threshold ? even + 1 : even;
    odd = keys[j + 3] <= threshold ? odd + 1 : odd;
  }
  for (; j < n; ++j) even = keys[j] <= threshold ? even + 1 : even;
  return even + odd;
}

/// A threshold with exactly k of the n keys at or below it; invariant: count(low) < k <= count(high). Guesses alternate
/// between interpolation and bisection.
vint find_threshold(const vint* keys, int n, int k, KeyRange range) {
  if (k == 1) range.smallest = keys[0] < range.smallest ? keys[0] : range.smallest;
  vint low = range.smallest - 1, high = range.largest, below = -(keys[0] < range.smallest), above = splat_int(n);
  for (bool interpolate = true;; interpolate = !interpolate) {
    const vint interval = high - low;
    vint middle = low + (interval >> 1);
    if (interpolate) {
      const vfloat part = __builtin_convertvector(k - below, vfloat) / __builtin_convertvector(above - below, vfloat);
      const vint guess = low + __builtin_convertvector(__builtin_convertvector(interval, vfloat) * part, vint);
      middle = guess > low ? guess : low + 1;
      middle = middle < high ? middle : high - 1;
      middle = interval > 1 ? middle : low;
    }
    const vint count = count_below(keys, n, middle);
    const vint enough = count >= k;
    high = enough ? middle : high;
    above = enough ? count : above;
    low = enough ? low : middle;
    below = enough ? below : count;
    // A lane with exactly k keys is done; closing its interval keeps it that way.
    low = count == k ? high : low;
    if (!any(high - low > 1)) return high;
  }
}

}  // namespace

void NeighbourSearch::find(const Planes& guide, int x, int y, vint* keys, uint16_t* chosen) const {
  const int n = static_cast<int>(offsets_.size());
  const KeyRange range = make_keys(guide, x, y, offsets_, index_mask_, keys);
  const vint threshold = find_threshold(keys, n, k_, range);

  constexpr int kWord = 32;
  for (int first = 0, word = 0; first < n; first += kWord, ++word) {
    vint taken = {};
    for (int j = first; j < std::min(n, first + kWord); ++j)
      taken |= (keys[j] <= threshold) & static_cast<int32_t>(1u << (j - first));
    keys[word] = taken;  // keys up to this word are no longer needed
  }
  const int n_words = (n + kWord - 1) / kWord;
  for (int l = 0; l < kLanes; ++l) {
    uint16_t* to = chosen + static_cast<ptrdiff_t>(l) * k_;
    for (int word = 0; word < n_words; word += 2) {
      uint64_t taken = static_cast<uint32_t>(keys[word][l]);
      if (word + 1 < n_words) taken |= uint64_t{static_cast<uint32_t>(keys[word + 1][l])} << kWord;
      // Write several at a time without checking how many are left: excess entries are overwritten by what follows.
      uint16_t* next = to + std::popcount(taken);
      for (; to < next; to += kNeighboursAtOnce)
        for (int i = 0; i < kNeighboursAtOnce; ++i, taken &= taken - 1)
          to[i] = static_cast<uint16_t>(word * kWord + std::countr_zero(taken));
      to = next;
    }
  }
}

}  // namespace covary
