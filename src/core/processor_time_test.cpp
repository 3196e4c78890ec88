// SPDX-License-Identifier: Apache-2.0
#include "core/processor_time.h"

#include <gtest/gtest.h>

namespace covary {
namespace {

TEST(ClockSeconds, AreThoseOfTheProcessorsThatOtherProgramsLeave) {
  EXPECT_DOUBLE_EQ(clock_seconds(12, 4, 20, 5), 3) << "alone";
  EXPECT_DOUBLE_EQ(clock_seconds(12, 4, 5, 5), 12) << "a quarter of the processors";
  EXPECT_DOUBLE_EQ(clock_seconds(12, 4, 21, 5), 3) << "no more than all";
  EXPECT_DOUBLE_EQ(clock_seconds(12, 4, 0.01, 0.05), 3) << "too short to tell";
  EXPECT_DOUBLE_EQ(clock_seconds(12, 4, 0, 5), 300) << "asleep, but not for ever";
}

TEST(ProcessorSeconds, RunWhileThereIsWork) {
  const double before = processor_seconds();
  while (processor_seconds() < before + 0.01) {
  }
  EXPECT_GE(processor_seconds(), before + 0.01);
}

}  // namespace
}  // namespace covary
