// SPDX-License-Identifier: Apache-2.0
// The K pixels of a window whose CRN means are nearest to the target's, one item a pixel: filters/neighbours.h, with
// the same keys, and so with the same choice.
//
// Definitions: K, WINDOW, INDEX_MASK (the low bits of a key that hold the candidate's index).
// Compiled: K=25 WINDOW=11 INDEX_MASK=127
#include "portable.h"

#define FAR 1e18f
#define CANDIDATES (WINDOW * WINDOW)

// Where the candidates are: the guide image around the target.
typedef struct {
  GLOBAL const float* guide;
  GLOBAL const int* offsets;
  int width, height, x, y;
  float4 centre;
} Place;

// The squared distance with the candidate's index in its lowest bits. Non-negative floats compare like their bit
// patterns, so keys are distinct integers in the desired order.
FUNCTION int key_of(const Place* at, int j) {
  const int x = at->x + at->offsets[2 * j], y = at->y + at->offsets[2 * j + 1];
  float4 there = FLOAT4(FAR, FAR, FAR, 0.0f);
  if (x >= 0 && y >= 0 && x < at->width && y < at->height) there = vload4(y * at->width + x, at->guide);
  const float4 here = at->centre;
  const float blue = (1.0f - PLANTED_BUG) * (there.z - here.z);
  const float squares = squared_length(there.x - here.x, there.y - here.y, blue);
  return (as_int(squares) & ~INDEX_MASK) | j;
}

// `offsets`: dx, dy of each candidate, from the centre outwards. `chosen`: the i-th candidate of pixel p, in ascending
// order, at i * pixels + p.
KERNEL nearest(GLOBAL const float* RESTRICT guide, GLOBAL const int* RESTRICT offsets, int width, int height,
               GLOBAL ushort* RESTRICT chosen) {
  Place at;
  at.x = get_global_id(0), at.y = get_global_id(1);
  if (at.x >= width || at.y >= height) return;
  const int p = at.y * width + at.x, pixels = width * height;
  at.guide = guide, at.offsets = offsets, at.width = width, at.height = height;
  at.centre = vload4(p, guide);

  // The smallest ignores key 0, which is mostly the target's own, with distance zero.
  int smallest = 0x7fffffff, largest = 0;
  for (int j = 0; j < CANDIDATES; ++j) {
    const int key = key_of(&at, j);
    if (j > 0 || K == 1) smallest = min(smallest, key);
    largest = max(largest, key);
  }
  // A threshold with exactly K keys at or below it; invariant: count(low) < K <= count(high). Guesses alternate between
  // interpolation and bisection.
  int low = smallest - 1, high = largest, above = CANDIDATES;
  int below = key_of(&at, 0) < smallest ? 1 : 0;
  for (int interpolate = 1; above != K && high - low > 1; interpolate = !interpolate) {
    int middle = low + ((high - low) >> 1);
    if (interpolate) {
      const float part = (float)(K - below) / (float)(above - below);
      middle = min(max(low + (int)((float)(high - low) * part), low + 1), high - 1);
    }
    int count = 0;
    for (int j = 0; j < CANDIDATES; ++j) count += key_of(&at, j) <= middle ? 1 : 0;
    if (count >= K) {
      high = middle, above = count;
    } else {
      low = middle, below = count;
    }
  }
  int n = 0;
  for (int j = 0; j < CANDIDATES && n < K; ++j)
    if (key_of(&at, j) <= high) chosen[(size_t)n++ * pixels + p] = (ushort)j;
}
