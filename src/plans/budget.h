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
  /// Minimum samples of each pass: one for each of its groups.
  uint32_t fewest = 1;
};

/// Samples per pixel of each pass; they add up to `budget`, or more if the passes need more.
std::vector<uint32_t> samples_of_passes(const Shares& shares, uint32_t budget);

/// Maximum samples per pixel of any render.
inline constexpr uint32_t kMaxBudget = 1u << 30;

/// The part of the frame to render. Throws Error(kUsage) if the request's is not inside the frame.
CropWindow window_of(const LoadedScene& scene, const RenderRequest& request);

/// Maximum samples per pixel of all passes together.
uint32_t largest_budget(const LoadedScene& scene, const RenderRequest& request);
/// Samples per pixel from which on a predicted error is taken as it is; without a target, as many as there may be.
uint32_t first_budget(const LoadedScene& scene, const RenderRequest& request);
/// Samples per pixel, of all passes together, before the error is checked for the first time: fewer for means, denoised
/// or not, two for each of twelve groups.
uint32_t samples_before_check(const LoadedScene& scene, const Plan& plan, const RenderRequest& request);

/// Default number of groups of each pass that the estimator reads: choose_groups() of film/groups.h for the state's
/// group_budget. With a time limit, when the number of samples is only roughly known, divisors do not help: 12, or
/// fewer if there are fewer samples.
int number_of_groups(const Shares& shares, const PlanState& state);

/// Sets the samples per pixel of each pass for the state's budget: exactly, or, on the way to a target error, rounded
/// up to whole groups unless the request does not allow that.
void set_budget(const Shares& shares, const PlanState& state, std::span<Pass> passes);

/// Samples per second, from trials of some ten milliseconds spread over the window. `stop` (may be null) ends them.
double samples_per_second(const LoadedScene& scene, const Integrator& integrator, const FilterSettings& filter,
                          const CropWindow& window, const std::atomic<bool>* stop);

/// The same for samples of the auxiliary images.
double auxiliary_samples_per_second(const LoadedScene& scene, const FilterSettings& filter, const CropWindow& window,
                                    const std::atomic<bool>* stop);

/// The next budget on the way to a relMSE of `target`, at most `most` times as large: the error falls like 1 / samples,
/// or more slowly.
uint32_t next_budget(uint32_t budget, double predicted, double target, uint32_t limit, double most);

/// The successive budgets of a render to a target error: each is decided on the complete films of the one before. The
/// films record the budgets (film_key::kBudgets), so that a resumed render repeats them: decided again on half-finished
/// films, they would differ.
class ErrorRounds {
 public:
  explicit ErrorRounds(uint32_t first) : budgets_{first} {}
  uint32_t budget() const { return budgets_[now_]; }
  /// Adopts the budgets recorded in a film of an earlier call, unless more are known already, with `limit` for those
  /// above it. Throws Error(kInput), naming `path`, if they are invalid.
  void take(const std::string& text, uint32_t limit, const std::string& path);
  /// Moves on to the next budget if an earlier call decided on one.
  bool repeat();
  /// Moves on to a newly decided budget.
  void add(uint32_t budget);
  std::string text() const;

 private:
  std::vector<uint32_t> budgets_;
  size_t now_ = 0;
};

/// The relMSE that the render is to reach; 0 if that is no goal.
double relmse_goal(const RenderRequest& request);

}  // namespace covary
