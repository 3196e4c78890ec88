// SPDX-License-Identifier: Apache-2.0
#include "lab/time_estimate.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>
#include <thread>

#include "core/process.h"
#include "lab/runner.h"

namespace covary::lab {
namespace {

/// Side of the square in the middle of the pixels that is rendered, and samples of each pixel.
constexpr int kTrialSide = 48;
constexpr uint32_t kTrialSpp = 16;
/// Of a run apart from loading and rendering: starting the program, writing and measuring the image.
constexpr double kSecondsAround = 0.3;

/// The window's middle.
CropWindow middle(const CropWindow& window) {
  const int width = std::min(kTrialSide, window.width), height = std::min(kTrialSide, window.height);
  return {window.x + (window.width - width) / 2, window.y + (window.height - height) / 2, width, height};
}

}  // namespace

double TimeEstimator::seconds_of(const Suite& suite, const std::vector<const Run*>& runs, const Speed& speed) {
  double seconds = 0;
  std::set<std::string> rendered;  // passes
  for (const Run* run : runs) {
    const double work = rendered.insert(run->passes_key).second ? run->work : 0;
    const double budget = run->timed ? suite.budgets[run->budget].seconds : 0;
    seconds += budget + work * speed.seconds_per_sample + speed.seconds_per_run;
  }
  return seconds;
}

TimeEstimator::TimeEstimator(const ExperimentOptions& options) : options_(options) {
  if (!options_.reader) options_.reader = std::make_shared<SceneReader>(options_.program, options_.stop);
}

TimeEstimator::Trial TimeEstimator::try_out(const Suite& suite, const SceneInstance& scene, uint32_t spp,
                                            const Runner& runner) const {
  Suite trial = suite;
  trial.reference = {spp, {}};
  SceneInstance part = scene;
  part.entry.reference.reset();
  part.window = middle(scene.window);
  if (!part.frames.empty()) part.frames = {scene.frames.front()}, part.entry.frames = fmt::format("{}", part.frames[0]);
  const Run run = reference_runs(trial, part, options_.context).front();
  Runner::Result result;
  result.record = runner.find(run);
  if (!result.record) result = runner.execute(run, part);
  runner.remove_passes(run.passes_key);
  if (result.failure) return {std::nullopt, complaint(result.failure->message)};
  if (!result.record) return {};  // stopped
  const double cores = options_.threads > 0 ? options_.threads : std::max(1u, std::thread::hardware_concurrency());
  return {Speed{result.record->processor_seconds / cores / run.work, result.record->load_seconds + kSecondsAround}, ""};
}

const TimeEstimator::Trial& TimeEstimator::trial_of(const Suite& suite, const SceneInstance& scene,
                                                    const Runner& runner) {
  const std::string key = fmt::format("{} {}x{} {} {}", scene.hash, scene.frame_width, scene.frame_height,
                                      fmt::join(scene.entry.defines, " "), fmt::join(suite.common_options, " "));
  if (const auto known = trials_.find(key); known != trials_.end()) return known->second;
  Trial trial = try_out(suite, scene, kTrialSpp, runner);
  const uint32_t most = suite.reference_of(scene.entry).spp;
  for (uint32_t spp = 4 * kTrialSpp; !trial.failure.empty() && spp <= most; spp *= 4)
    trial = try_out(suite, scene, spp, runner);
  return trials_.emplace(key, std::move(trial)).first->second;
}

TimeEstimate TimeEstimator::of(const Suite& suite, int64_t max_pixels, double min_work) {
  throw_if_invalid(suite);
  const Cache cache(options_.cache_folder);
  const Runner runner(cache, options_.program, options_.threads, options_.stop);
  const auto stopped = [this] { return options_.stop && options_.stop->load(); };
  TimeEstimate estimate;
  std::vector<ScenePlan> plans;
  std::vector<std::vector<const Run*>> missing;
  double work = 0;
  for (size_t s = 0; s < suite.scenes.size() && !stopped(); ++s)
    plans.push_back(plan_scene(suite, s, options_.scenes_folder, max_pixels, options_.context, *options_.reader));
  for (const ScenePlan& plan : plans) {
    missing.emplace_back();
    for (const std::vector<Run>* runs : {&plan.references, &plan.runs})
      for (const Run& run : *runs) {
        ++estimate.runs;
        if (runner.find(run))
          ++estimate.finished;
        else
          missing.back().push_back(&run), work += run.work;
      }
  }
  for (size_t s = 0; s < plans.size() && !stopped(); ++s) {
    const Trial trial = plans[s].failure     ? Trial{std::nullopt, complaint(plans[s].failure->message)}
                        : missing[s].empty() ? Trial{}
                        : work < min_work    ? Trial{Speed{}, ""}
                                             : trial_of(suite, plans[s].scene, runner);
    if (!trial.failure.empty() && estimate.left_out.empty())
      estimate.left_out = suite.scenes[s].name + ": " + trial.failure;
    if (trial.speed) estimate.seconds += seconds_of(suite, missing[s], *trial.speed);
  }
  return estimate;
}

}  // namespace covary::lab
