// SPDX-License-Identifier: Apache-2.0
// Time limits with a clock of the test's own: what a render of known costs does with its time.
#include "plans/time_budget.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace covary {
namespace {

/// A render of 640 x 360 pixels that takes 0.47 s for each sample of an auxiliary image, 1.8 s for each of a pass, and
/// 20 s for its end, as a room with a network on one slow thread.
constexpr TimeCosts kRoom{1.8, 0.47, 20};

TEST(PlanTime, SplitsTheTime) {
  const TimePlan plan = plan_time(kRoom, 60, 1, 64);
  EXPECT_EQ(plan.aov_samples, 19u) << "15 % of 60 s";
  EXPECT_EQ(plan.samples, 17u) << "(60 - 20 - 19 * 0.47) / 1.8 = 17.3";
  EXPECT_NEAR(plan.seconds, 20 + 19 * 0.47 + 17 * 1.8, 1e-9);
  EXPECT_EQ(plan_time(kRoom, 6000, 1, 64).aov_samples, 64u);
  EXPECT_EQ(plan_time({1, 0, 0}, 10, 1, 64).aov_samples, 0u) << "there are none";
}

/// If even the least takes longer, it is done, and the plan says how long that takes.
TEST(PlanTime, KnowsWhatTheLeastTakes) {
  const TimePlan plan = plan_time(kRoom, 10, 4, 64);
  EXPECT_EQ(plan.aov_samples, 1u);
  EXPECT_EQ(plan.samples, 4u);
  EXPECT_NEAR(plan.seconds, 20 + 0.47 + 4 * 1.8, 1e-9);
  EXPECT_EQ(plan_time(kRoom, 28.5, 4, 64).aov_samples, 2u) << "(28.5 - 20 - 4 * 1.8) / 0.47 = 2.8";
}

/// An end that takes most of the time is not shortened much by leaving out samples.
TEST(PlanTime, GivesSamplesAShareOfATimeThatIsTooShort) {
  const TimePlan plan = plan_time({0.01, 0, 12}, 5, 1, 0);
  EXPECT_EQ(first_round(plan, 1), 75u) << "0.15 * 5 / 0.01";
  EXPECT_GT(plan.seconds, 12.75);
}

/// The seconds of each trial of an end that takes `load` at first, and 0.1 s for each row.
std::vector<double> trials_of(int height, double allowed, double load, double* end) {
  std::vector<double> all;
  *end = time_of_end(height, allowed, [&](int rows) {
    all.push_back(0.1 * rows + (all.empty() ? load : 0));
    return all.back();
  });
  return all;
}

TEST(TimeOfEnd, TrialsTakeNoMoreThanTheirShare) {
  double end = 0;
  EXPECT_EQ(trials_of(200, 100, 1, &end).size(), 3u);
  EXPECT_NEAR(end, 20, 1e-9);
  EXPECT_EQ(trials_of(200, 6, 1, &end).size(), 2u) << "2.6 + 1.6 + 4.8 > 6";
  EXPECT_NEAR(end, 20, 1e-9);
  EXPECT_EQ(trials_of(200, 1.3, 1, &end).size(), 2u) << "what loads once is not part of the end";
  EXPECT_NEAR(end, 20, 1e-9);
  EXPECT_EQ(trials_of(200, 1.2, 1, &end).size(), 1u) << "the second might take as long as the first";
  EXPECT_NEAR(end, 32.5, 1e-9) << "with what loads once";
  EXPECT_EQ(trials_of(40, 100, 1, &end).size(), 2u);
  EXPECT_NEAR(end, 4, 1e-9);
}

/// Renders with a pilot that errs by `pilot`, and a machine that takes `load` times as long while the passes run.
double seconds_of(TimeCosts costs, double limit, double pilot, double load, uint32_t fewest = 1) {
  TimeCosts expected = costs;
  expected.sample *= pilot;
  const TimePlan plan = plan_time(expected, limit, fewest, 64);
  double now = plan.aov_samples * costs.auxiliary, passes = 0;
  uint32_t taken = 0;
  for (uint32_t target = first_round(plan, fewest); target > taken;) {
    passes += (target - taken) * costs.sample * load, now += (target - taken) * costs.sample * load;
    taken = target;
    target = next_round(taken, passes / taken, limit - costs.end - now);
  }
  EXPECT_GE(taken, fewest);
  return now + costs.end;
}

TEST(TimeBudget, IsKeptWithinATenth) {
  for (const TimeCosts& costs : {kRoom, TimeCosts{0.01, 0.002, 0.1}, TimeCosts{1e-5, 0, 0}, TimeCosts{0.3, 0.1, 2}})
    for (const double limit : {30.0, 60.0, 600.0})
      for (const double pilot : {0.6, 1.0, 2.0})
        for (const double load : {0.5, 1.0, 1.9}) {
          const double seconds = seconds_of(costs, limit, pilot, load);
          EXPECT_LE(seconds, 1.001 * limit) << costs.sample << " " << limit << " " << pilot << " " << load;
          EXPECT_GE(seconds, limit - std::max(costs.sample * load, 0.1 * limit))
              << "no time is left for another sample";
        }
}

TEST(TimeBudget, TheLeastIsDoneHoweverLongItTakes) {
  EXPECT_NEAR(seconds_of(kRoom, 1, 1, 1, 12), 20 + 0.47 + 12 * 1.8, 1e-9);
}

TEST(TimeChoice, IsWrittenAsOptions) {
  EXPECT_EQ((TimeChoice{33, 11, 16}.text()), "--spp 33 --groups 11 --aov-samples 16");
  EXPECT_EQ((TimeChoice{33, {}, {}}.text()), "--spp 33");
}

}  // namespace
}  // namespace covary
