// SPDX-License-Identifier: Apache-2.0
// Weights by which lights are chosen in proportion to their powers. A light may become unlikely, never impossible.
#pragma once

#include <span>
#include <vector>

#include "scene/emitter.h"

namespace covary {

struct LightPower {
  double power;  ///< at least 0; any number where none is known
  bool exact;    ///< false: an estimate from some points, Emitter::knows_power()
};

/// In proportion to the powers. A light whose power is an estimate weighs at least 1 % of the mean light, so that one
/// whose few bright points were missed is found. All weigh the same where no power is positive or one is not finite.
std::vector<double> weights_by_power(std::span<const LightPower> lights);

}  // namespace covary
