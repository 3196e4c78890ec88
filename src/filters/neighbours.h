// SPDX-License-Identifier: Apache-2.0
// The k pixels of a window whose CRN means are nearest to the target's (Yang & Moon 2025, Sec. 4): the control variates
// of a pixel. Processes kLanes horizontally adjacent targets at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "filters/planes.h"

namespace covary {

class NeighbourSearch {
  static constexpr int kNeighboursAtOnce = 8;

 public:
  /// `k`: at most the number of candidates, window^2.
  NeighbourSearch(int k, int window);

  int k() const { return k_; }
  /// Candidates, from the centre outwards.
  const std::vector<Offset>& offsets() const { return offsets_; }
  size_t chosen_size() const { return static_cast<size_t>(k_) * lanes::kLanes + kNeighboursAtOnce; }

  /// Selects neighbours of the pixels (x + lane, y). chosen[lane * k + i] is an index into offsets(), ascending in i.
  /// `guide`: three planes with a border of at least window / 2, kFar where there is no pixel; such candidates are
  /// chosen only if there are no others. Distances that agree to 14 bits count as equal; ties go to the one nearer to
  /// the target. `keys`: scratch for offsets().size() vectors; `chosen` must have chosen_size() elements.
  void find(const Planes& guide, int x, int y, lanes::vint* keys, uint16_t* chosen) const;

 private:
  int k_;
  std::vector<Offset> offsets_;
  int index_mask_;  ///< low bits of a key that hold the candidate's index
};

}  // namespace covary
