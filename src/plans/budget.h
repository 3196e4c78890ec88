// SPDX-License-Identifier: Apache-2.0
// How many samples each pass takes, and in how many groups.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "plans/plan.h"

namespace covary {

/// Groups of a pass where nothing else is asked for, [YM2025] Sec. 5.
inline constexpr int kUsualGroups = 12;

/// Samples per pixel that no render exceeds.
inline constexpr uint32_t kMaxBudget = 1u << 30;

/// The part of the frame that is rendered. Throws Error(kUsage) where the request's is not inside the frame.
CropWindow window_of(const LoadedScene& scene, const RenderRequest& request);

/// The most samples per pixel of all passes together that may be taken.
uint32_t largest_budget(const LoadedScene& scene, const RenderRequest& request);
/// Those to begin with, before a wanted error is looked at for the first time.
uint32_t first_budget(const LoadedScene& scene, const RenderRequest& request);

/// How many groups each pass of an estimator keeps: `asked`, or kUsualGroups, or as many as the smallest pass has
/// samples where these are fewer, at least `fewest`. `smallest_part`: of that pass, of the budget. Throws Error(kUsage)
/// where fewer than `fewest` are asked for; `name` is the estimator's.
int number_of_groups(const std::string& name, std::optional<int> asked, int fewest, double smallest_part,
                     uint32_t budget);

/// Sets the samples per pixel of each pass for a budget of `total`, rounded up to whole groups. `parts`: of the passes.
void set_budget(std::span<const double> parts, uint32_t total, std::span<Pass> passes);

/// Samples per second, from trials all over the window: some ten milliseconds.
double samples_per_second(const LoadedScene& scene, const Integrator& integrator, const FilterSettings& filter,
                          const CropWindow& window);

/// The next budget on the way to a relMSE of `target`: error falls like 1 / samples, or more slowly.
uint32_t next_budget(uint32_t budget, double predicted, double target, uint32_t limit);

}  // namespace covary
