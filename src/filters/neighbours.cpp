// SPDX-License-Identifier: Apache-2.0
#include "filters/neighbours.h"

#include <bit>
#include <span>

#include "core/error.h"

namespace covary {

using namespace lanes;

NeighbourSearch::NeighbourSearch(int k, int window, bool include_target) : k_(k), offsets_(window_offsets(window)) {
  if (!include_target) offsets_.erase(offsets_.begin());
  COVARY_CHECK(k >= 1 && k <= static_cast<int>(offsets_.size()), "neighbours: k does not fit the window");
  index_mask_ = static_cast<int>(std::bit_ceil(offsets_.size())) - 1;
}

namespace {

/// Smallest and largest of keys. Key 0 is left out of the smallest: mostly it is the target's own, of distance zero.
struct KeyRange {
  vint smallest, largest;
};

/// A key is the squared distance with the candidate's index in its lowest bits. Non-negative floats compare like their
/// bits, so keys are distinct integers in the order wanted.
KeyRange make_keys(const Planes& guide, int x, int y, std::span<const Offset> offsets, int index_mask, vint* keys) {
  const vfloat f0 = load(guide.row(0, y) + x), f1 = load(guide.row(1, y) + x), f2 = load(guide.row(2, y) + x);
  KeyRange range{splat_int(INT32_MAX), splat_int(0)};
  for (int j = 0; j < static_cast<int>(offsets.size()); ++j) {
    const int gx = x + offsets[j].dx, gy = y + offsets[j].dy;
    const vfloat d0 = load(guide.row(0, gy) + gx) - f0;
    const vfloat d1 = load(guide.row(1, gy) + gx) - f1;
    const vfloat d2 = load(guide.row(2, gy) + gx) - f2;
    const vint key = (bits(d0 * d0 + d1 * d1 + d2 * d2) & ~index_mask) | j;
    keys[j] = key;
    if (j > 0) range.smallest = key < range.smallest ? key : range.smallest;
    range.largest = key > range.largest ? key : range.largest;
  }
  return range;
}

/// A threshold with exactly k of the n keys at or below it: count(low) < k <= count(high). Guesses alternate between
/// interpolation and bisection.
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
    vint count = {};
    for (int j = 0; j < n; ++j) count -= keys[j] <= middle;
    const vint enough = count >= k;
    high = enough ? middle : high;
    above = enough ? count : above;
    low = enough ? low : middle;
    below = enough ? below : count;
    // A lane with exactly k keys is done; closing its interval keeps it so.
    low = count == k ? high : low;
    int open = 0;
    for (int l = 0; l < kLanes; ++l) open |= high[l] - low[l] > 1;
    if (!open) return high;
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
    keys[word] = taken;  // keys up to this word are not needed any more
  }
  for (int l = 0; l < kLanes; ++l) {
    int i = 0;
    for (int word = 0; word * kWord < n; ++word)
      for (uint32_t taken = static_cast<uint32_t>(keys[word][l]); taken; taken &= taken - 1)
        chosen[l * k_ + i++] = static_cast<uint16_t>(word * kWord + std::countr_zero(taken));
  }
}

}  // namespace covary
