// SPDX-License-Identifier: Apache-2.0
#include "plans/budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/stopwatch.h"

namespace covary {

int number_of_groups(const std::string& name, std::optional<int> asked, int fewest, double smallest_part,
                     uint32_t budget) {
  const auto samples = static_cast<int>(smallest_part * budget);
  const int groups = asked.value_or(std::clamp(samples, fewest, kUsualGroups));
  if (groups < fewest)
    throw Error(ErrorCode::kUsage,
                fmt::format("{} groups are too few: {} needs at least {} groups to measure how pixels vary together",
                            groups, name, fewest));
  return groups;
}

void set_budget(std::span<const double> parts, uint32_t total, std::span<Pass> passes) {
  for (size_t i = 0; i < passes.size(); ++i) {
    const auto groups = static_cast<uint32_t>(passes[i].film.groups());
    const auto wanted = static_cast<uint32_t>(std::ceil(parts[i] * total - 1e-9));
    passes[i].settings.spp = (std::max(wanted, 1u) + groups - 1) / groups * groups;
  }
}

double samples_per_second(const LoadedScene& scene, const Integrator& integrator, const FilterSettings& filter,
                          const CropWindow& window) {
  constexpr int kCells = 8, kSide = 16;  // a square of pixels in each cell of a grid
  PassSettings settings;
  settings.spp = 1;
  settings.filter = filter;
  const auto trial = [&](uint64_t seed) {
    settings.seed = seed;
    std::atomic<uint64_t> n_samples{0};
    const Stopwatch watch;
    parallel_for(kCells * kCells, [&](int i) {
      const int x = i % kCells * window.width / kCells, y = i / kCells * window.height / kCells;
      const int width = std::clamp(window.width / kCells, 1, kSide),
                height = std::clamp(window.height / kCells, 1, kSide);
      Film film(scene.width, scene.height, {window.x + x, window.y + y, width, height}, 1);
      n_samples += render_pass(*scene.scene, integrator, settings, film).n_samples;
    });
    return static_cast<double>(n_samples) / watch.seconds();
  };
  trial(1);  // fills the caches
  return trial(2);
}

uint32_t next_budget(uint32_t budget, double predicted, double target, uint32_t limit) {
  const double factor = std::clamp(1.1 * predicted / target, 1.25, 4.0);
  return static_cast<uint32_t>(std::min<double>(limit, std::ceil(factor * budget)));
}

}  // namespace covary
