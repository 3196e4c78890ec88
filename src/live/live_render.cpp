// SPDX-License-Identifier: Apache-2.0
#include "live/live_render.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/error.h"
#include "estimators/mean.h"
#include "live/coarse.h"
#include "live/first_picture.h"
#include "plans/budget.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

using Json = nlohmann::json;

constexpr double kNumbersSeconds = 0.25;  // between numbers for the page
constexpr double kLastSeconds = 3;        // that readers have to take the last picture

/// Whether the estimator makes another image of the films than their mean.
bool makes_image(const Plan& plan) { return !plan.method->film_holds_image(); }

GroupedImage grouped(const Image& image) {
  GroupedImage groups;
  groups.width = image.width, groups.height = image.height, groups.groups = 1, groups.data = image.data.data();
  return groups;
}

}  // namespace

LiveRender::LiveRender(int port, LiveTexts texts, std::function<void()> stop)
    : texts_(std::move(texts)),
      stop_(std::move(stop)),
      page_(port, texts_.title, [this](const Json& asked) { act(asked); }) {
  page_.say({{"kind", "render"},
             {"phase", "loading"},
             {"output", texts_.output},
             {"resume", texts_.resume},
             {"pictures", Json::array()},
             {"can", Json::object()}});
}

RenderResult LiveRender::render(const LoadedScene& scene, const Plan& plan, const RenderRequest& request,
                                const RenderCallbacks& callbacks) {
  {
    const std::lock_guard lock(mutex_);
    of_ = std::make_unique<Watched>(Watched{scene, plan, request, callbacks});
  }
  begun();
  RenderResult result = covary::render(scene, plan, request, watching());
  if (page_.is_watched() && !result.passes.empty() && result.samples_per_pixel() > 0) {
    show_mean(result.passes);
    if (result.image.estimate.data.empty()) labels_.erase("picture");  // otherwise it is that of the last estimate
    say_pictures();
  }
  const std::lock_guard lock(mutex_);
  page_.say(numbers(done_, total_));
  of_.reset();
  return result;
}

void LiveRender::begun() {
  const auto& [scene, plan, request, inner] = *of_;
  const CropWindow window = window_of(scene, request);
  {
    const std::lock_guard lock(mutex_);
    watch_ = Stopwatch();
    spp_ = largest_budget(scene, request);
    until_ = request.until;
  }
  const bool may_grow = request.seconds <= 0 && !plan.method->pixel_pass();
  page_.say({{"phase", "preparing"},
             {"size", Json::array({window.width, window.height})},
             {"origin", Json::array({window.x, window.y})},
             {"can",
              {{"stop", true},
               {"pause", true},
               {"more", may_grow && spp_ < kMaxBudget / 2},
               {"raise", may_grow && plan.method->predicts_error && !request.films_only},
               {"region", !plan.method->pixel_pass()}}}});
  say_goal();
  try {
    first_picture();
  } catch (const Error&) {  // the render itself says what is wrong
  }
}

void LiveRender::first_picture() {
  const auto& [scene, plan, request, inner] = *of_;
  const Stopwatch all;
  const auto [image, stride] = first_picture_of(scene, plan, request, inner.stop);
  if (inner.stop && inner.stop->load()) return;
  show("mean", image, stride);
  labels_["mean"] = "first samples";
  if (makes_image(plan) && plan.method->one_pass()) {
    const Stopwatch watch;
    MethodSettings settings;
    settings.crn_samples = 1;
    show("picture", plan.method->image({{}, grouped(image)}, settings).estimate, stride);
    denoised_pixel_cost_ = watch.seconds() / (static_cast<double>(image.width) * image.height);
    labels_["picture"] = "first samples";
  }
  spent_ += all.seconds();
  say_pictures();
}

RenderCallbacks LiveRender::watching() {
  const RenderCallbacks& inner = of_->inner;
  RenderCallbacks callbacks = inner;
  callbacks.stage = [&](RenderStage stage) {
    constexpr const char* kNames[] = {"short trials", "training",   "auxiliary images",
                                      "rendering",    "estimating", "writing"};
    counts_samples_ = stage == RenderStage::kTraining || stage == RenderStage::kRendering;
    page_.say({{"phase", kNames[static_cast<int>(stage)]}});
    if (inner.stage) inner.stage(stage);
  };
  callbacks.progress = [&](uint64_t done, uint64_t total) {
    if (inner.progress) inner.progress(done, total);
    if (counts_samples_) progress(done, total);
    wait_while_paused();
  };
  callbacks.wave = [&](std::span<const Pass> passes) {
    if (inner.wave) inner.wave(passes);
    wave(passes);
  };
  callbacks.small_waves = true;
  callbacks.auxiliary = [&](const std::map<std::string, Image>& images) { aovs_ = &images; };
  callbacks.estimated = [&](const EstimatorResult& result, const std::optional<PredictedError>& predicted) {
    show_estimate(result, predicted);
  };
  callbacks.region = [&] {
    const std::lock_guard lock(mutex_);
    return region_;
  };
  callbacks.goal = [&](RenderRequest& request) {
    const std::lock_guard lock(mutex_);
    if (!raised_) return;
    request.spp = spp_;
    request.until = until_;
  };
  callbacks.whole_image = &whole_image_;
  return callbacks;
}

// ---- pictures -------------------------------------------------------------------------------------------------------

void LiveRender::show(const char* name, const Image& image, int stride) { page_.show(name, live_image(image, stride)); }

void LiveRender::say_pictures() {
  Json pictures = Json::array();
  const bool denoised = of_->plan.method->one_pass() && makes_image(of_->plan);
  const std::pair<const char*, const char*> names[] = {{"mean", "Mean"}, {"picture", denoised ? "Denoised" : "Image"}};
  for (const auto& [id, name] : names)
    if (labels_.contains(id)) pictures.push_back({{"id", id}, {"name", name}, {"label", labels_[id]}});
  page_.say({{"pictures", pictures}, {"errors", errors_}});
}

void LiveRender::add_error(const char* of, double relmse, const std::optional<PredictedBounds>& bounds) {
  Json error = {{"of", of}, {"seconds", seconds()}, {"relmse", relmse}};
  if (bounds) error["low"] = bounds->low, error["high"] = bounds->high;
  errors_.push_back(error);
}

void LiveRender::show_mean(std::span<const Pass> passes) {
  std::vector<const Film*> films;
  for (const Pass& pass : camera_passes(passes)) films.push_back(&pass.film);
  const Pass* light = light_pass(passes);
  const auto [mean, std_error] = mean_of_films(films, light ? &light->film : nullptr);
  show("mean", mean);
  double samples = 0;
  for (const Film* film : films) samples += film->mean_count();
  labels_["mean"] = fmt::format("{:.4g} samples per pixel", samples);
  if (std_error.data.empty()) return page_.remove("mean:error");
  show("mean:error", std_error);
  EstimatorResult result;
  result.estimate = mean, result.std_error = std_error;
  const double relmse = predicted_relmse(result);
  labels_["mean"] += fmt::format(", predicted relMSE {:.2g}", relmse);
  add_error("mean", relmse, std::nullopt);
}

/// What the estimator makes of the films as they are, from squares of pixels that are as small as the time allows.
void LiveRender::show_denoised(std::span<const Pass> passes) {
  const auto& [scene, plan, request, inner] = *of_;
  if (!makes_image(plan)) return;
  const std::span<const Pass> cameras = camera_passes(passes);
  const Film &first = cameras.front().film, &last = cameras.back().film;
  const bool is_pair = cameras.size() > 1 && plan.method->pair();
  // Such estimators read counts and variances of samples, which only whole films have.
  const bool whole = is_pair && plan.method->adaptive && !plan.method->adaptive->reads_groups;
  int groups = std::min(first.groups(), last.groups());
  for (const Film* film : {&first, &last})
    for (const uint32_t count : film->counts()) groups = std::min<int>(groups, static_cast<int>(count));
  if (!whole && (groups < plan.method->min_groups || groups < 1)) return;
  const double area = static_cast<double>(first.width()) * first.height() * denoised_pixel_cost_;
  int stride = 1;
  while (!whole && stride < kMaxStride && !may_spend(area / (stride * stride))) stride *= 2;
  if (!may_spend(area / (stride * stride))) return;
  const Stopwatch watch;
  const auto taken = [&](const Film& film) {
    return whole ? CoarseGroups{{}, rows_of(film, 0, film.height())} : coarse_groups(film, stride, groups);
  };
  const CoarseGroups independent = taken(last), crn = is_pair ? taken(first) : CoarseGroups{};
  std::map<std::string, Image> aovs;
  if (aovs_ && plan.method->reads_features)
    for (const auto& [name, image] : *aovs_) aovs[name] = coarse_image(image, stride);
  MethodSettings settings;
  settings.crn_samples = std::max<int64_t>(1, std::llround(first.mean_count()));
  settings.features = features_among(aovs);
  EstimatorResult made = plan.method->image({crn.image, independent.image}, settings);
  show("picture", made.estimate, stride);
  page_.remove("picture:error");
  labels_["picture"] = fmt::format("{:.4g} samples per pixel{}", first.mean_count() + (is_pair ? last.mean_count() : 0),
                                   stride > 1 ? fmt::format(", 1 : {}", stride) : "");
  denoised_pixel_cost_ = watch.seconds() / (static_cast<double>(made.estimate.width) * made.estimate.height);
}

void LiveRender::show_estimate(const EstimatorResult& result, const std::optional<PredictedError>& predicted) {
  if (predicted) {
    const std::lock_guard lock(mutex_);
    relmse_ = of_->request.until_in_blocks ? predicted_blocks(result) : predicted->relmse;
    goal_total_ = until_ > 0 ? static_cast<uint64_t>(static_cast<double>(done_) * std::max(1.0, relmse_ / until_)) : 0;
  }
  const bool is_mean = !makes_image(of_->plan);
  if (predicted) add_error(is_mean ? "mean" : "picture", predicted->relmse, predicted->bounds);
  if (!is_mean) {
    show("picture", result.estimate);
    labels_["picture"] = "";
    if (result.std_error.data.empty())
      page_.remove("picture:error");
    else
      show("picture:error", result.std_error);
    if (predicted)
      labels_["picture"] = fmt::format(
          "predicted relMSE {:.2g}{}", predicted->relmse,
          predicted->bounds ? fmt::format(" ({:.2g} to {:.2g})", predicted->bounds->low, predicted->bounds->high) : "");
  }
  say_pictures();
}

void LiveRender::wave(std::span<const Pass> passes) {
  double rays = 0, samples = 0, per_pixel = 0;
  for (const Pass& pass : passes) {
    rays += static_cast<double>(pass.result.n_rays), samples += static_cast<double>(pass.result.n_samples);
    if (!pass.plan.light) per_pixel += pass.film.mean_count();
  }
  {
    const std::lock_guard lock(mutex_);
    if (samples > 0) rays_per_sample_ = rays / samples;
    samples_per_pixel_ = per_pixel;
  }
  wait_while_paused();
  seconds_ = seconds();
  const bool is_first = mean_samples_ == 0;
  if (!page_.is_seen() || !(is_first || may_spend(mean_cost_))) return;
  const Stopwatch watch;
  try {
    show_mean(passes);
    mean_cost_ = watch.seconds();
    mean_samples_ = static_cast<uint64_t>(samples);
    spent_ += mean_cost_;
    const Stopwatch of_denoised;
    show_denoised(passes);
    spent_ += of_denoised.seconds();
  } catch (const Error& error) {  // the render is worth more than pictures on the way
    page_.say({{"message", std::string("no picture could be made: ") + error.what()}});
  }
  say_pictures();
}

// ---- numbers and buttons --------------------------------------------------------------------------------------------

double LiveRender::seconds() const {
  const std::lock_guard lock(mutex_);
  return watch_.seconds() - paused_seconds_;
}

/// With mutex_ locked.
Json LiveRender::numbers(uint64_t done, uint64_t total) const {
  const double now = watch_.seconds() - paused_seconds_ - (paused_ ? watch_.seconds() - paused_since_ : 0);
  const double rate = static_cast<double>(done - std::min(done, first_done_)) / std::max(now, 1e-3);
  const uint64_t end = goal_total_ > 0 ? goal_total_ : until_ > 0 ? 0 : total;
  double left = rate > 0 && end > 0 ? static_cast<double>(end - std::min(end, done)) / rate : -1;
  const double limit = of_ ? of_->request.seconds : 0;
  if (limit > 0) left = std::max(0.0, left < 0 ? limit - now : std::min(left, limit - now));
  return {{"seconds", now},
          {"done", done},
          {"total", end},
          {"samples_per_second", rate},
          {"rays_per_second", rate * rays_per_sample_},
          {"samples_per_pixel", samples_per_pixel_},
          {"left", left},
          {"paused", paused_.load()}};
}

void LiveRender::progress(uint64_t done, uint64_t total) {
  const std::unique_lock lock(mutex_, std::try_to_lock);
  if (!lock) return;  // tiles do not wait
  done_ = std::max(done_, done), total_ = total;
  if (watch_.seconds() < next_numbers_) return;
  next_numbers_ = watch_.seconds() + kNumbersSeconds;
  page_.say(numbers(done_, total_));
}

void LiveRender::wait_while_paused() {
  if (!paused_) return;
  std::unique_lock lock(mutex_);
  const std::atomic<bool>* stop = of_->inner.stop;
  while (paused_ && !(stop && stop->load())) resumed_.wait_for(lock, std::chrono::milliseconds(100));
}

void LiveRender::say_goal() {
  const std::lock_guard lock(mutex_);
  Json region;
  if (region_) region = Json::array({region_->x, region_->y, region_->width, region_->height});
  page_.say({{"spp", spp_ < kMaxBudget ? Json(spp_) : Json()}, {"until", until_}, {"region", region}});
}

/// In the server's thread.
void LiveRender::act(const Json& asked) {
  const std::string what = asked.at("do");
  {
    const std::lock_guard lock(mutex_);
    if (what == "stop") {
      whole_image_ = true;
      if (stop_) stop_();
    }
    const bool pause = what == "pause";
    if (pause && !paused_) paused_since_ = watch_.seconds();
    if (!pause && paused_ && (what == "go" || what == "stop")) paused_seconds_ += watch_.seconds() - paused_since_;
    if (pause) paused_ = true;
    if (what == "go" || what == "stop") paused_ = false;
    if (what == "more" && spp_ < kMaxBudget / 2) spp_ *= 2, raised_ = true;
    if (what == "raise" && (until_ > 0 || relmse_ > 0)) {
      until_ = (until_ > 0 ? until_ : relmse_) / 2, raised_ = true;
      spp_ = kMaxBudget;
      goal_total_ = relmse_ > 0 ? static_cast<uint64_t>(static_cast<double>(done_) * relmse_ / until_) : 0;
    }
    if (what == "region") {
      region_.reset();
      const Json& at = asked.at("region");
      if (!at.is_null()) region_ = CropWindow{at.at(0), at.at(1), at.at(2), at.at(3)};
    }
    page_.say(numbers(done_, total_));
  }
  resumed_.notify_all();
  say_goal();
}

void LiveRender::end(const std::string& text) {
  page_.say({{"ended", text}, {"phase", "ended"}, {"can", Json::object()}});
  page_.wait_until_seen(kLastSeconds);
}

}  // namespace covary
