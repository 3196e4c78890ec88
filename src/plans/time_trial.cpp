// SPDX-License-Identifier: Apache-2.0
// What the parts of a render with a time limit take, from trials before it begins, and its rounds.
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <utility>

#include "combine/combine.h"
#include "core/number_text.h"
#include "core/random.h"
#include "core/stop.h"
#include "film/film_file.h"
#include "integrators/aov.h"
#include "passes/training.h"
#include "plans/pass_files.h"
#include "plans/plan_run.h"
#include "plans/result_files.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// A trial of training takes one pixel in each square of this side. Training that takes a larger share of the time is
/// told beforehand.
constexpr int kTrainingStride = 8;
constexpr double kTrainingShare = 0.5;

/// Uniform in [0, 1).
float number(size_t i) { return PathRandom(Sampling::kIndependent, 1, 0, i, 0).get_1d(0, Event::kPixel); }

/// An image without meaning, with noise.
Image made_up_image(int width, int height) {
  Image image(width, height, 3);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] = 0.4f + 0.2f * number(i);
  return image;
}

/// A film without meaning: a sample in each group.
Film made_up_film(int frame_width, int frame_height, const CropWindow& window, const PassPlan& plan) {
  Film film(frame_width, frame_height, window, plan.groups);
  if (plan.sample_variance) film.keep_sample_variance();
  std::fill(film.counts().begin(), film.counts().end(), static_cast<uint32_t>(plan.groups));
  for (size_t i = 0; i < film.data().size(); ++i) film.data()[i] = 0.2f + 0.6f * number(i);
  return film;
}

uint32_t sum_of_groups(std::span<const PassPlan> plans) {
  uint32_t sum = 0;
  for (const PassPlan& plan : plans) sum += static_cast<uint32_t>(plan.groups);
  return sum;
}

/// A name beside the output that no other program has.
std::string trial_file(const std::string& output) {
  const fs::path path(output);
  return (path.parent_path() / fmt::format(".{}.{}.exr", path.stem().string(), getpid())).string();
}

}  // namespace

/// Seconds for estimate and files of a band of the frame, whose samples are made up: all of it depends on sizes alone.
double PlanRun::end_of_band(int n_rows, std::span<const PassPlan> plans) {
  const CropWindow band{window_.x, window_.y + (window_.height - n_rows) / 2, window_.width, n_rows};
  RenderResult result;
  for (const PassPlan& plan : plans) {
    Pass& pass = result.passes.emplace_back();
    pass.plan = plan;
    pass.film = made_up_film(scene_.width, scene_.height, band, plan);
  }
  if (needs_aovs())
    for (const AuxiliaryFeature& feature : kAuxiliaryFeatures)
      result.aovs[feature.layer] = made_up_image(band.width, n_rows);
  ExtraInputs beside;
  if (plan_.method->reads_features) beside.features = features_among(result.aovs);
  const Stopwatch watch;
  if (!plan_.makes_film() && !request_.films_only)
    run_stoppable(callbacks_.stop, [&] { result.image = finish(image_of(plan_, result.passes, 0, n_rows, beside)); });
  if (stopped() || request_.output.empty()) return watch.seconds();
  RenderRequest request = request_;
  request.output = trial_file(request_.output), request.beside.clear();
  try {
    write_result_files(plan_, request, result);
    if (!request_.passes.empty())
      for (const Pass& pass : result.passes) write_film(request.output, pass.film);
  } catch (const Error&) {  // the files of the render itself will say why
  }
  std::error_code ignored;
  fs::remove(request.output, ignored);
  fs::remove(preview_path(request.output), ignored);
  return watch.seconds();
}

void PlanRun::warn_of_long_training() const {
  if (!callbacks_.warning || !request_.load_training.empty()) return;
  const std::shared_ptr<Integrator> trial = integrator_->clone();
  trial->prepare(*scene_.scene);
  TrainingSettings settings{window_, filter_, callbacks_.stop, {}, {}};
  settings.seed = request_.seed, settings.stride = kTrainingStride;
  const Stopwatch watch;
  if (!train(*scene_.scene, *trial->learning(), settings)) return;
  const double updates = trial->learning()->update_seconds();  // hardly depend on the number of pixels
  const double seconds = sqr(kTrainingStride) * (watch.seconds() - updates) + updates;
  if (seconds > kTrainingShare * request_.seconds)
    callbacks_.warning(fmt::format("of `time` {:g}, training with {} samples per pixel takes about {:.2g} s",
                                   request_.seconds, trial->learning()->training_spp(), seconds));
}

/// The passes of all phases, with this number of samples per pixel for groups.
std::vector<PassPlan> PlanRun::passes_with(uint32_t group_budget) const {
  PlanState state = state_;
  state.group_budget = group_budget;
  std::vector<PassPlan> all;
  for (const Phase& phase : plan_.phases) {
    const std::vector<PassPlan> passes = phase.passes(state);
    all.insert(all.end(), passes.begin(), passes.end());
  }
  return all;
}

double PlanRun::time_of_end(double seconds_per_sample) {
  const std::vector<PassPlan> plans = passes_with(static_cast<uint32_t>(
      std::clamp(0.5 * request_.seconds / seconds_per_sample, 1.0, static_cast<double>(state_.budget))));
  return covary::time_of_end(window_.height, kTrialShare * request_.seconds,
                             [&](int rows) { return end_of_band(rows, plans); });
}

TimeCosts PlanRun::measure_costs() {
  TimeCosts costs;
  const auto pixels = static_cast<double>(n_pixels());
  costs.sample =
      times_traced() * pixels / samples_per_second(scene_, *state_.integrator, filter_, window_, callbacks_.stop);
  if (needs_aovs()) costs.auxiliary = pixels / auxiliary_samples_per_second(scene_, filter_, window_, callbacks_.stop);
  costs.end = time_of_end(costs.sample);
  return costs;
}

void PlanRun::plan_time_limit() {
  const Stopwatch watch;
  const uint32_t limit = largest_budget(scene_, request_);
  costs_ = measure_costs();
  if (stopped()) return;
  // Where a later phase's samples depend on a denoised first pass, that takes as long as the image.
  const double between = static_cast<double>(plan_.phases.size() - 1) * costs_.end;
  const double passed = watch_.seconds(), left = request_.seconds - passed;
  TimePlan plan = plan_time(costs_, left - between, sum_of_groups(passes_with(1)), aov_samples_);
  plan.seconds += between;
  if (plan.seconds > left && callbacks_.warning)
    callbacks_.warning(fmt::format(
        "`time` {:g} is too short: the minimum takes about {:.2g} s ({:.2g} for trials of the speed, {}{:.2g} for {} "
        "per "
        "pixel, {:.2g} for the image and its files)",
        request_.seconds, passed + plan.seconds, passed,
        costs_.auxiliary > 0 ? fmt::format("{:.2g} for auxiliary images, ", plan.aov_samples * costs_.auxiliary) : "",
        plan.samples * costs_.sample, counted(plan.samples, "sample"), between + costs_.end));
  if (needs_aovs()) aov_samples_ = plan.aov_samples;
  // No more groups are begun than can be filled if the trials were wrong by a factor of two; but an error, and filters,
  // need some.
  constexpr uint32_t kUseful = 4;
  const bool are_some = kUseful * costs_.sample < 0.6 * left;  // though the end might leave less time
  const uint32_t fewest = request_.until > 0 ? state_.budget : are_some ? kUseful : std::min(plan.samples, kUseful);
  if (in_rounds() || plan_.groups_follow_speed)
    state_.group_budget = std::max(fewest, std::min(limit, plan.samples / 2));
  if (in_rounds())
    state_.budget = std::min(limit, first_round(plan, sum_of_groups(passes_with(state_.group_budget))));
  else
    reserved_seconds_ = between + plan.aov_samples * costs_.auxiliary + costs_.end;
}

bool PlanRun::next_round_fits() {
  const auto taken = static_cast<uint32_t>(std::max<double>(state_.budget, std::floor(camera_samples())));
  const double per_sample = round_samples_ > 0 ? round_seconds_ / round_samples_ : costs_.sample / times_traced();
  const double later = costs_.end + (times_traced() - 1) * per_sample * taken;
  const uint32_t next = next_round(taken, times_traced() * per_sample, request_.seconds - watch_.seconds() - later);
  state_.budget = std::min(next, largest_budget(scene_, request_));
  return state_.budget > taken;
}

/// Whether the image was made so much earlier than trials let expect, as on a machine that is busy for a while, that
/// the time serves for more samples and another image of all of them.
bool PlanRun::has_time_for_another_image() {
  constexpr double kMuch = 0.6, kFiles = 1.3;  // of the time; of the estimate, with files
  if (!estimate_seconds_ || request_.until > 0 || stopped() || watch_.seconds() > kMuch * request_.seconds)
    return false;
  costs_.end = std::min(costs_.end, kFiles * *estimate_seconds_);
  return true;
}

/// Records what the clock decided.
void PlanRun::keep_choice() {
  if (!in_rounds()) return;
  TimeChoice choice;
  choice.samples = state_.budget;
  if (plan_.groups_follow_speed) choice.groups = state_.passes[0].film.groups();
  if (needs_aovs() && aov_samples_ != request_.aov_samples) choice.aov_samples = aov_samples_;
  for (Pass& pass : state_.passes) pass.film.attributes[film_key::kTimeChoice] = choice.text();
  result_.of_time = choice;
}

}  // namespace covary
