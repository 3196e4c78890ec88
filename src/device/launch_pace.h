// SPDX-License-Identifier: Apache-2.0
// How much of a kernel's work is launched at once. The driver of a display stops a kernel after about two seconds, and
// the display stands still meanwhile; so a long launch becomes several, whose sizes follow from the time that the
// previous ones took. Work groups do not depend on each other, so results have the same bits.
#pragma once

#include <cstdint>

namespace covary::device {

class LaunchPace {
 public:
  /// What a launch is meant to take at most. Work may be unequal within an image, so that much is left up to 2 s.
  static constexpr double kSeconds = 0.1;

  explicit LaunchPace(uint32_t groups_at_first) : groups_(groups_at_first) {}

  /// Work groups that may be launched at once, at least one.
  uint32_t groups() const { return groups_; }
  /// So many groups, launched together and alone, took so long.
  void measured(uint32_t groups, double seconds);

 private:
  uint32_t groups_;
};

}  // namespace covary::device
