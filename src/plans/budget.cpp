// SPDX-License-Identifier: Apache-2.0
#include "plans/budget.h"

#include <fmt/format.h>

#include <fmt/ranges.h>
#include <algorithm>
#include <atomic>
#include <cmath>
#include <numeric>
#include <sstream>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "film/groups.h"
#include "integrators/aov.h"
#include "plans/render.h"

namespace covary {
namespace {

constexpr uint32_t kFirstBudget = 96;
/// For the next budget towards a target error: a larger one overshoots, a smaller one checks more often.
constexpr double kMargin = 1.02, kMinGrowth = 1.06;

/// Samples per second of the fastest of three trials, after one that warms the caches: other work on the machine may
/// hold up any of them. `render` takes one sample of each pixel and returns their number.
template <typename Render>
double speed_of_trials(const LoadedScene& scene, const FilterSettings& filter, const CropWindow& window,
                       const std::atomic<bool>* stop, const Render& render) {
  constexpr int kCells = 8, kSide = 16;  // one square of pixels in each cell of a grid
  PassSettings settings;
  settings.spp = 1;
  settings.filter = filter;
  settings.stop = stop;
  const auto trial = [&](uint64_t seed) {
    settings.seed = seed;
    std::atomic<uint64_t> n_samples{0};
    const Stopwatch watch;
    parallel_for(kCells * kCells, [&](int i) {
      const int x = i % kCells * window.width / kCells, y = i / kCells * window.height / kCells;
      const int width = std::clamp(window.width / kCells, 1, kSide),
                height = std::clamp(window.height / kCells, 1, kSide);
      Film film(scene.width, scene.height, {window.x + x, window.y + y, width, height}, 1);
      n_samples += render(settings, film);
    });
    return static_cast<double>(n_samples) / watch.seconds();
  };
  trial(1);
  return std::max({trial(2), trial(3), trial(4)});
}

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

double relmse_goal(const RenderRequest& request) { return request.until_in_blocks ? 0 : request.until; }

uint32_t samples_before_check(const LoadedScene& scene, const Plan& plan, const RenderRequest& request) {
  constexpr uint32_t kOfMeans = 24;
  const bool is_mean = plan.phases.size() == 1 && !plan.method->pair() && !plan.has_crn_pass;
  const uint32_t usual = first_budget(scene, request);
  return request.until > 0 && is_mean ? std::min(usual, kOfMeans) : usual;
}

std::vector<uint32_t> samples_of_passes(const Shares& shares, uint32_t budget) {
  return split_samples(budget, shares.parts, shares.fewest);
}

int number_of_groups(const Shares& shares, const PlanState& state) {
  constexpr uint32_t kMax = 12;
  const std::vector<uint32_t> samples = samples_of_passes(shares, state.group_budget);
  if (state.request.seconds <= 0) return choose_groups(samples);
  return static_cast<int>(std::min(kMax, *std::min_element(samples.begin(), samples.end())));
}

void set_budget(const Shares& shares, const PlanState& state, std::span<Pass> passes) {
  std::vector<uint32_t> samples = samples_of_passes(shares, state.budget);
  if (state.request.until > 0) {
    const std::vector<uint32_t> whole = split_into_whole_groups(state.budget, shares.parts, passes[0].film.groups());
    const uint64_t sum = std::accumulate(whole.begin(), whole.end(), uint64_t{0});
    if (!state.request.spp || sum <= *state.request.spp) samples = whole;
  }
  for (size_t i = 0; i < passes.size(); ++i) passes[i].settings.spp = samples[i];
}

double samples_per_second(const LoadedScene& scene, const Integrator& integrator, const FilterSettings& filter,
                          const CropWindow& window, const std::atomic<bool>* stop) {
  return speed_of_trials(scene, filter, window, stop, [&](const PassSettings& settings, Film& film) {
    return render_pass(*scene.scene, integrator, settings, film).n_samples;
  });
}

double auxiliary_samples_per_second(const LoadedScene& scene, const FilterSettings& filter, const CropWindow& window,
                                    const std::atomic<bool>* stop) {
  return speed_of_trials(scene, filter, window, stop, [&](const PassSettings& settings, Film& film) {
    render_aovs(*scene.scene, settings, 1, film, stop);
    return film.counts().size();
  });
}

uint32_t next_budget(uint32_t budget, double predicted, double target, uint32_t limit, double most) {
  const double factor = std::clamp(kMargin * predicted / target, kMinGrowth, most);
  return static_cast<uint32_t>(std::min<double>(limit, std::ceil(factor * budget)));
}

void ErrorRounds::take(const std::string& text, uint32_t limit, const std::string& path) {
  std::vector<uint32_t> budgets;
  std::istringstream words(text);
  bool good = true;
  for (std::string word; good && words >> word;) {
    uint64_t budget = 0;
    good = word.size() <= 10 && word.find_first_not_of("0123456789") == std::string::npos;
    if (good) budget = std::stoull(word);
    good = good && budget > (budgets.empty() ? 0 : budgets.back()) && budget <= UINT32_MAX;
    budgets.push_back(static_cast<uint32_t>(budget));
  }
  if (!good || budgets.empty())
    throw Error(ErrorCode::kInput, fmt::format("{}: attribute covary:budgets is '{}'; expected numbers of samples "
                                               "per pixel, ascending",
                                               path, text));
  for (uint32_t& budget : budgets) budget = std::min(budget, limit);
  budgets.erase(std::unique(budgets.begin(), budgets.end()), budgets.end());
  if (budgets.size() >= budgets_.size()) budgets_ = std::move(budgets);
}

bool ErrorRounds::repeat() {
  if (now_ + 1 == budgets_.size()) return false;
  ++now_;
  return true;
}

void ErrorRounds::add(uint32_t budget) {
  budgets_.push_back(budget);
  ++now_;
}

std::string ErrorRounds::text() const { return fmt::format("{}", fmt::join(budgets_, " ")); }

}  // namespace covary
