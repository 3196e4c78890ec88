// SPDX-License-Identifier: Apache-2.0
// What the end of a render with a time limit takes, from trials that keep to a share of the time.
#pragma once

#include <functional>

namespace covary {

/// Seconds that the end takes for an image of `height` rows, from trials of few of them: trial(rows) returns its
/// seconds, of which the first is longer because it loads what the others use. No further trial is made that would make
/// all of them take longer than `allowed` seconds.
double time_of_end(int height, double allowed, const std::function<double(int rows)>& trial);
inline constexpr double kTrialShare = 0.15;  ///< of the time, for these trials

}  // namespace covary
