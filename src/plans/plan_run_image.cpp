// SPDX-License-Identifier: Apache-2.0
#include "plans/plan_run.h"

#include <fmt/format.h>

#include <array>
#include <exception>
#include <filesystem>
#include <utility>

#include "combine/combine.h"
#include "combine/layer_sources.h"
#include "core/error.h"
#include "core/stop.h"
#include "denoising/history.h"
#include "integrators/aov.h"
#include "passes/sample_parts.h"
#include "plans/light_plan.h"
#include "plans/pass_files.h"
#include "plans/result_files.h"
#include "plans/training_stage.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

namespace fs = std::filesystem;

/// Seconds of work after which films are worth saving, even unasked, before the image is computed from them.
constexpr double kMinSecondsWorthACheckpoint = 10;
constexpr double kEstimateOfInterrupted = 0.5;  // seconds allowed for it; after that the image is the mean

}  // namespace

EstimatorResult PlanRun::estimate_rows(int first_row, int n_rows, std::span<const Film> layers) const {
  std::array<Image, feature::kCount> images;
  ExtraInputs beside{features(), {}};
  for (size_t i = 0; i < feature::kCount; ++i)
    if (const Image*& image = beside.features.*kImagesOfFeatures[i])
      images[i] = rows_of(*image, first_row, n_rows), image = &images[i];
  for (size_t i = 0; i < layers.size(); ++i)
    beside.layers.push_back({layer_names_[i], rows_of(layers[i], first_row, n_rows)});
  const std::span<const Pass> cameras = camera_passes(state_.passes);
  const Pass* light = light_pass(state_.passes);
  if (light && denoises_light(plan_, cameras.back().film, light->film)) beside.light = &light->film, light = nullptr;
  const GroupedImage light_rows = light ? rows_of(light->film, first_row, n_rows) : GroupedImage{};
  EstimatorResult image = finish(image_of(plan_, cameras, first_row, n_rows, beside), light ? &light_rows : nullptr);
  if (has_training()) add_training(state_.passes[0].film, result_.training, first_row, image);
  return image;
}

/// False if interrupted or, for a render that was interrupted earlier, if it takes too long.
bool PlanRun::estimate() {
  // An estimate that was stopped because it took too long is not tried again.
  if (result_.interrupted && estimate_stopped_after_ > kEstimateOfInterrupted) return false;
  begin(RenderStage::kEstimating);
  const Stopwatch watch;
  const bool whole = callbacks_.whole_image && callbacks_.whole_image->load();
  const auto ends = [&] {
    if (result_.interrupted && whole) return false;
    return result_.interrupted ? watch.seconds() > kEstimateOfInterrupted : stopped();
  };
  EstimatorResult image;
  result_.image = {};
  result_.predicted.reset();
  const bool with_layers = request_.splits_layers() && !result_.interrupted;
  if (with_layers) trace_layers();
  if (with_layers && stopped()) return false;
  const std::span<const Film> layers = with_layers ? std::span<const Film>(layers_) : std::span<const Film>();
  if (!run_stoppable(ends, [&] { image = estimate_rows(0, window_.height, layers); })) {
    estimate_stopped_after_ = watch.seconds();
    return false;
  }
  for (size_t i = 0; i < image.layers.size(); ++i) result_.aovs[layer_names_[i]] = std::move(image.layers[i]);
  for (size_t i = 0; i < image.kept_samples.size(); ++i)
    if (!image.kept_samples[i].data.empty()) result_.aovs[kKeptSamples[i]] = std::move(image.kept_samples[i]);
  double samples = 0;
  for (const Pass& pass : camera_passes(films())) samples += pass.film.mean_count();
  result_.predicted = predicted_error(image, samples, plan_.method->reliable_samples);
  if (result_.predicted) result_.predicted_blocks = predicted_blocks(image);
  if (request_.until > 0 && !result_.predicted)
    throw Error(ErrorCode::kUsage, "an error can only be predicted from 2 or more groups");
  if (callbacks_.estimated) callbacks_.estimated(image, result_.predicted);
  if (plan_.makes_film()) image.estimate = {};
  result_.image = std::move(image);
  estimate_seconds_ = watch.seconds();
  result_.seconds.estimate += *estimate_seconds_;
  return true;
}

void PlanRun::render_auxiliary_images() {
  begin(RenderStage::kAuxiliary);
  const Stopwatch watch;
  Pass& last = state_.passes[camera_passes(state_.passes).size() - 1];
  PassSettings settings = last.settings;
  settings.progress = callbacks_.progress;
  render_aovs(*scene_.scene, settings, aov_samples_, last.film, callbacks_.stop, request_.alpha);
  result_.aovs = std::exchange(last.film.aovs, {});
  if (callbacks_.auxiliary && !stopped()) callbacks_.auxiliary(result_.aovs);
  result_.seconds.auxiliary = watch.seconds();
}

/// As many samples as the last pass has, including those that earlier calls have traced.
void PlanRun::trace_layers() {
  const Pass& pass = camera_passes(films()).back();
  if (!of_layers_) {
    if (request_.layers) layer_names_.assign(std::begin(kLayerNames), std::end(kLayerNames));
    const std::vector<std::string> groups = light_groups(*scene_.scene);
    if (request_.light_groups) {
      for (const std::string& group : groups) layer_names_.push_back("Combined_" + group);
      layer_names_.emplace_back(kRest);
    }
    of_layers_ = request_.layers ? pass.integrator->of_direct_light() : pass.integrator->by_light(groups);
    of_layers_->prepare(*scene_.scene);
    layers_ = films_of_parts(pass.film, layer_names_.size(), pass.film.groups());
  }
  PassSettings settings = pass.settings;
  settings.stop = callbacks_.stop;
  settings.progress = nullptr;
  if (request_.light_groups) return trace_parts(*scene_.scene, *of_layers_, settings, pass.film, layers_);
  trace_direct_light(*scene_.scene, *of_layers_, settings, pass.film, layers_[0]);
  if (!stopped()) layers_[1] = indirect_light(pass.film, layers_[0]);
}

bool PlanRun::try_to_keep_films(bool complete, const char* then) {
  const Stopwatch watch;
  since_checkpoint_ = Stopwatch();
  try {
    save_passes(request_, films(), complete);
    unsaved_ = false;
  } catch (const std::exception& error) {
    if (callbacks_.warning) callbacks_.warning(fmt::format("the films could not be kept: {}; {}", error.what(), then));
  }
  result_.seconds.write += watch.seconds();
  return !unsaved_;
}

/// Saves films that took long before anything else is done with them.
void PlanRun::keep_films_before_more() {
  const bool asked = !request_.passes.empty();
  if (unsaved_ && (asked || since_checkpoint_.seconds() > kMinSecondsWorthACheckpoint))
    try_to_keep_films(!stopped(), "the image is made nevertheless");
}

/// After an error, if all films were complete.
void PlanRun::keep_films_of_failure() noexcept {
  if (!consistent_ || !unsaved_ || done_ == 0 || films().empty() || films()[0].path.empty()) return;
  try {
    if (try_to_keep_films(false, "they are lost") && callbacks_.warning)
      callbacks_.warning(
          is_output(films()[0], request_)
              ? fmt::format("the film is kept in '{}'; `resume` continues it", request_.output)
              : fmt::format("the films are kept in '{}'; `resume` continues them", passes_folder(request_).string()));
  } catch (...) {  // no memory for the warning's text
  }
}

void PlanRun::write_files() {
  result_.integrator = state_.integrator;
  result_.passes = std::move(state_.passes);
  if (result_.interrupted && result_.samples_per_pixel() == 0) return;
  begin(RenderStage::kWriting);
  const bool is_film = is_output(result_.passes[0], request_);
  if (plan_.makes_film() && has_training())
    result_.image.estimate = with_training(result_.passes[0].film, result_.training);
  if (request_.path_lengths && !result_.interrupted) {
    keep_films_before_more();
    add_path_lengths();
    result_.interrupted = stopped();
  }
  std::exception_ptr failure;
  if (unsaved_ && (!request_.passes.empty() || (result_.interrupted && !is_film))) {
    try {
      save_passes(request_, result_.passes, !result_.interrupted);
      unsaved_ = false;
    } catch (const Error&) {  // the image is smaller and may still fit
      failure = std::current_exception();
    }
  }
  write_result_files(plan_, request_, result_);
  if (failure) std::rethrow_exception(failure);
  unsaved_ = unsaved_ && !is_film;
  if (result_.interrupted)
    result_.kept = is_film ? request_.output : passes_folder(request_).string();
  else
    remove_passes(request_, result_.passes);
}

void PlanRun::add_path_lengths() {
  const Pass& pass = camera_passes(result_.passes).back();
  PassSettings settings = pass.settings;
  settings.stop = callbacks_.stop;
  std::vector<Image> images = path_length_images(*scene_.scene, *pass.integrator, settings, pass.film);
  for (size_t i = 0; i < images.size(); ++i) result_.aovs[fmt::format("Edges{:02}", i + 1)] = std::move(images[i]);
}

}  // namespace covary
