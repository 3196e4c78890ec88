// SPDX-License-Identifier: Apache-2.0
#include "plans/budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "core/error.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "plans/render.h"

namespace covary {
namespace {

constexpr uint32_t kFirstBudget = 96;

}  // namespace

CropWindow window_of(const LoadedScene& scene, const RenderRequest& request) {
  if (!request.crop) return {scene.crop_x, scene.crop_y, scene.crop_width, scene.crop_height};
  const CropWindow& c = *request.crop;
  if (c.x < 0 || c.y < 0 || c.width < 1 || c.height < 1 || c.width > scene.width - c.x || c.height > scene.height - c.y)
    throw Error(ErrorCode::kUsage, fmt::format("the crop {},{},{},{} does not fit into the {} x {} frame", c.x, c.y,
                                               c.width, c.height, scene.width, scene.height));
  return c;
}

uint32_t largest_budget(const LoadedScene& scene, const RenderRequest& request) {
  const bool open_ended = request.seconds > 0 || request.until > 0;
  return request.spp.value_or(open_ended ? kMaxBudget : static_cast<uint32_t>(scene.spp));
}

uint32_t first_budget(const LoadedScene& scene, const RenderRequest& request) {
  const uint32_t largest = largest_budget(scene, request);
  return request.until > 0 ? std::min(largest, kFirstBudget) : largest;
}

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
