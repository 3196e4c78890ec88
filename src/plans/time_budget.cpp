// SPDX-License-Identifier: Apache-2.0
#include "plans/time_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace covary {
namespace {

/// Fraction of the expected samples in the first round, and of those that fit in each of the others: less than all of
/// them, because a busy machine may become slower by a factor of two meanwhile.
constexpr double kFirstPart = 0.3, kPart = 0.4;
/// Part of a time that is too short for the first round: an image whose end takes most of the time would hardly be
/// earlier without its samples.
constexpr double kMinShare = 0.15;

/// Rows of two trials of the end, whose difference leaves out what does not depend on the size.
constexpr int kFewRows = 16, kMoreRows = 48;

/// Rounded down; not more than a film can hold.
uint32_t whole(double samples) { return static_cast<uint32_t>(std::clamp(samples, 0.0, double{1 << 30})); }

}  // namespace

double time_of_end(int height, double allowed, const std::function<double(int rows)>& trial) {
  const int few = std::min(height, kFewRows);
  double seconds = trial(few), used = seconds;
  if (used <= 2 * allowed) seconds = trial(few), used += seconds;  // without what loads once, mostly faster
  const double more_rows = static_cast<double>(kMoreRows) / few;
  if (height <= kMoreRows || used + more_rows * seconds > allowed) return seconds * height / few;
  const double more = trial(kMoreRows);
  const double per_row =
      std::max(more - seconds, more / kMoreRows * (kMoreRows - kFewRows) / 2) / (kMoreRows - kFewRows);
  return more + per_row * (height - kMoreRows);
}

TimePlan plan_time(const TimeCosts& costs, double seconds, uint32_t fewest, uint32_t aov_samples) {
  TimePlan plan;
  double left = seconds - costs.end;
  if (costs.auxiliary > 0) {
    const double for_auxiliary = std::min(kAuxiliaryShare * seconds, left - fewest * costs.sample);
    plan.aov_samples = std::clamp(whole(for_auxiliary / costs.auxiliary), 1u, std::max(aov_samples, 1u));
    left -= plan.aov_samples * costs.auxiliary;
  }
  const bool too_short = left < fewest * costs.sample;
  plan.samples = std::max(fewest, whole((too_short ? kMinShare / kFirstPart * seconds : left) / costs.sample));
  plan.seconds = costs.end + plan.aov_samples * costs.auxiliary + plan.samples * costs.sample;
  return plan;
}

uint32_t next_round(uint32_t taken, double seconds_per_sample, double left) {
  const double fit = left / seconds_per_sample;
  return fit < 1 ? taken : taken + std::max(1u, whole(kPart * fit));
}

uint32_t first_round(const TimePlan& plan, uint32_t fewest) {
  return std::max(fewest, whole(kFirstPart * plan.samples));
}

std::string TimeChoice::text() const {
  std::string text = fmt::format("--spp {}", samples);
  if (groups) text += fmt::format(" --groups {}", *groups);
  if (aov_samples) text += fmt::format(" --aov-samples {}", *aov_samples);
  return text;
}

}  // namespace covary
