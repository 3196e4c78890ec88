// SPDX-License-Identifier: Apache-2.0
#include "device/launch_pace.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace covary::device {
namespace {

/// Launches of `groups` groups, each of which takes so long.
int launches(LaunchPace& pace, uint32_t groups, double seconds_per_group, double* longest) {
  int n = 0;
  *longest = 0;
  for (uint32_t left = groups; left > 0; ++n) {
    const uint32_t at_once = std::min(left, pace.groups());
    pace.measured(at_once, at_once * seconds_per_group);
    *longest = std::max(*longest, at_once * seconds_per_group);
    left -= at_once;
  }
  return n;
}

TEST(LaunchPace, FindsHowMuchTakesTheTime) {
  LaunchPace pace(8);
  double longest = 0;
  launches(pace, 10000, 1e-3, &longest);  // ten seconds of work
  EXPECT_EQ(pace.groups(), 100u);
  EXPECT_NEAR(longest, LaunchPace::kSeconds, 1e-9);
  EXPECT_EQ(launches(pace, 10000, 1e-3, &longest), 100);
}

TEST(LaunchPace, LeavesShortWorkWhole) {
  LaunchPace pace(8);
  double longest = 0;
  EXPECT_EQ(launches(pace, 4096, 1e-7, &longest), 4);  // 8, 64, 512, and the rest
  EXPECT_EQ(launches(pace, 4096, 1e-7, &longest), 1);
}

/// Drivers compile a kernel when it runs first, so that it seems slow.
TEST(LaunchPace, RecoversFromASlowStart) {
  LaunchPace pace(64);
  pace.measured(64, 3.0);
  EXPECT_EQ(pace.groups(), 8u);
  double longest = 0;
  EXPECT_LE(launches(pace, 4096, 1e-6, &longest), 5);
}

TEST(LaunchPace, TakesNoRestForSlow) {
  LaunchPace pace(1000);
  pace.measured(1000, LaunchPace::kSeconds);
  pace.measured(1, 0.05);  // what a launch takes at least
  EXPECT_EQ(pace.groups(), 1000u);
  pace.measured(10, 1.0);
  EXPECT_EQ(pace.groups(), 1u);
  pace.measured(1, 100.0);
  EXPECT_EQ(pace.groups(), 1u);
}

}  // namespace
}  // namespace covary::device
