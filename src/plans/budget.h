// SPDX-License-Identifier: Apache-2.0
// How many samples each pass takes, and in how many groups.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "plans/plan.h"

namespace covary {

/// How passes share a budget of samples per pixel.
struct Shares {
  std::vector<double> parts;  ///< of the passes; they add up to 1
  /// Samples that each pass takes at least: as many as it has groups, so that each has one.
  uint32_t fewest = 1;
};

/// Samples per pixel of each pass that add up to `budget`, or more where that is less than the passes need.
std::vector<uint32_t> samples_of_passes(const Shares& shares, uint32_t budget);

/// Samples per pixel that no render exceeds.
inline constexpr uint32_t kMaxBudget = 1u << 30;

/// The part of the frame that is rendered. Throws Error(kUsage) where the request's is not inside the frame.
CropWindow window_of(const LoadedScene& scene, const RenderRequest& request);

/// The most samples per pixel of all passes together that may be taken.
uint32_t largest_budget(const LoadedScene& scene, const RenderRequest& request);
/// Those to begin with, before a wanted error is looked at for the first time.
uint32_t first_budget(const LoadedScene& scene, const RenderRequest& request);

/// How many groups each pass keeps that the estimator reads, where nobody asked for a number: choose_groups() of
/// film/groups.h for the state's group_budget. With a limit of time, when the number of samples is only known roughly
/// and nothing is gained by a divisor of it: 12, or fewer where there are fewer samples.
int number_of_groups(const Shares& shares, const PlanState& state);

/// Sets the samples per pixel of each pass for the state's budget: exactly, or on the way to a wanted error, which asks
/// for no number, rounded up to whole groups unless that is more than the request allows.
void set_budget(const Shares& shares, const PlanState& state, std::span<Pass> passes);

/// Samples per second, from trials all over the window: some ten milliseconds. `stop` (may be null) ends them.
double samples_per_second(const LoadedScene& scene, const Integrator& integrator, const FilterSettings& filter,
                          const CropWindow& window, const std::atomic<bool>* stop);

/// The next budget on the way to a relMSE of `target`: error falls like 1 / samples, or more slowly. At most `most`
/// times as large.
uint32_t next_budget(uint32_t budget, double predicted, double target, uint32_t limit, double most);

/// The budgets of a render to a wanted error, one after the other: each is decided on the films of the one before, when
/// these are complete. A render that is resumed goes the same way again, so the films keep the budgets
/// (film_key::kBudgets): decided anew on films that are half-way to the next one, they would differ.
class ErrorRounds {
 public:
  explicit ErrorRounds(uint32_t first) : budgets_{first} {}
  uint32_t budget() const { return budgets_[now_]; }
  /// Takes the budgets of a film that another call began, unless more are known, and `limit` for those above it. Throws
  /// Error(kInput), naming `path`, where they make no sense.
  void take(const std::string& text, uint32_t limit, const std::string& path);
  /// Goes on to the next budget if an earlier call decided on one.
  bool repeat();
  /// Goes on to a budget that was decided now.
  void add(uint32_t budget);
  std::string text() const;

 private:
  std::vector<uint32_t> budgets_;
  size_t now_ = 0;
};

}  // namespace covary
