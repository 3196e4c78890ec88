// SPDX-License-Identifier: Apache-2.0
#include "plans/integrator_trial.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>

#include "core/error.h"
#include "core/stopwatch.h"
#include "passes/training.h"
#include "plans/budget.h"
#include "plans/integrator_choice.h"
#include "plans/pass_files.h"
#include "plans/render_settings.h"
#include "risk/relative_weight.h"

namespace covary {
namespace {

constexpr double kShare = 0.06;          // fraction of the render's samples for trials, approximately
constexpr uint32_t kSamples = 8;         // of each integrator at a pixel
constexpr uint32_t kDefaultBudget = 64;  // if the number of samples is unknown
constexpr int kMinPixels = 1000;         // pixels sampled, if the window has as many
constexpr double kClearlyBetter = 0.9;
constexpr double kCutOff = 0.995;  // quantile that larger values are clamped to
/// Changes the render's seed, so that trials share no numbers with its passes.
constexpr uint64_t kOtherSeed = 0x9e3779b97f4a7c15;

/// Results of one integrator's samples at the sampled pixels.
struct Sampled {
  std::vector<Spectrum> means, variances;
  double rays = 0;  ///< per sample
};

uint32_t training_of(const Integrator& integrator) {
  return integrator.learning() ? integrator.learning()->training_spp() : 0;
}

/// Samples per pixel of the render, as far as known.
uint32_t budget_of(const LoadedScene& scene, const RenderRequest& request) {
  const bool is_open = !request.spp && (request.seconds > 0 || request.until > 0);
  return is_open ? kDefaultBudget : request.spp.value_or(static_cast<uint32_t>(scene.spp));
}

/// Why an integrator is not tried; empty if it is. One that learns needs enough remaining samples to benefit from
/// training.
std::string left_out(const Integrator& integrator, const Scene& scene, uint32_t budget) {
  if (scene.has_media() && !integrator.sees_media()) return "it does not support participating media";
  if (2 * training_of(integrator) > budget)
    return fmt::format("its training takes {} of {} samples", training_of(integrator), budget);
  return "";
}

class Trials {
 public:
  Trials(const LoadedScene& scene, const RenderRequest& request, double samples, const std::atomic<bool>* stop)
      : scene_(scene), window_(window_of(scene, request)), stop_(stop) {
    const double area = static_cast<double>(window_.width) * window_.height;
    const double wanted = std::sqrt(samples / (kShare * budget_of(scene, request)));
    stride_ = static_cast<int>(std::clamp(std::ceil(wanted), 1.0, std::max(1.0, std::sqrt(area / kMinPixels))));
    filter_ = request.filter.value_or(scene.filter);
    seed_ = request.seed ^ kOtherSeed;
  }

  Sampled sample(Integrator& integrator) const {
    const Scene& scene = *scene_.scene;
    if (LightTracingIntegrator* tracer = integrator.light_tracing())
      tracer->fix_light_tracing(static_cast<uint64_t>(window_.width) * window_.height, true);
    TrainingSettings training;
    training.window = window_, training.stride = stride_, training.filter = filter_;
    training.stop = stop_, training.seed = seed_;
    if (integrator.learning() && !train(scene, *integrator.learning(), training)) return {};
    PassSettings settings;
    settings.seed = seed_, settings.filter = filter_, settings.stop = stop_;
    settings.spp = one_in_each_square(window_, stride_, kSamples);
    Film film(scene_.width, scene_.height, window_, 1);
    film.keep_sample_variance();
    const PassResult result = render_pass(scene, integrator, settings, film);
    Sampled sampled;
    sampled.rays = static_cast<double>(result.n_rays) / static_cast<double>(std::max<uint64_t>(result.n_samples, 1));
    for (int y = stride_ / 2; y < window_.height; y += stride_)
      for (int x = stride_ / 2; x < window_.width; x += stride_) {
        sampled.means.push_back(film.mean(x, y));
        sampled.variances.push_back(film.sample_variance(x, y));
      }
    return sampled;
  }

  int columns() const { return (window_.width - stride_ / 2 + stride_ - 1) / stride_; }

 private:
  const LoadedScene& scene_;
  CropWindow window_;
  const std::atomic<bool>* stop_;
  int stride_ = 1;
  FilterSettings filter_;
  uint64_t seed_ = 0;
};

/// The weight of relMSE at each sampled pixel, from the mean brightness of all integrators over 3 x 3 sampled pixels.
std::vector<double> weights_of(std::span<const std::optional<Sampled>> all, int columns) {
  const size_t n = all[0]->means.size();
  std::vector<double> brightness(n), weights(n);
  for (const std::optional<Sampled>& one : all)
    for (size_t i = 0; one && i < n; ++i) brightness[i] += mean(one->means[i]);
  const double n_sampled = static_cast<double>(std::count_if(all.begin(), all.end(), [](const auto& s) { return s; }));
  const int rows = static_cast<int>(n) / columns;
  for (int y = 0; y < rows; ++y)
    for (int x = 0; x < columns; ++x) {
      double sum = 0, count = 0;
      for (int j = std::max(0, y - 1); j <= std::min(rows - 1, y + 1); ++j)
        for (int i = std::max(0, x - 1); i <= std::min(columns - 1, x + 1); ++i)
          sum += brightness[static_cast<size_t>(j) * columns + i] / n_sampled, count += 1;
      weights[static_cast<size_t>(y) * columns + x] = 1 / (square(sum / count) + 0.01);
    }
  return weights;
}

double relative_variance(const Sampled& sampled, const std::vector<double>& weights) {
  std::vector<double> values(weights.size());
  for (size_t i = 0; i < values.size(); ++i) values[i] = weights[i] * mean(sampled.variances[i]);
  std::vector<double> sorted = values;
  const auto most = sorted.begin() + static_cast<ptrdiff_t>(kCutOff * static_cast<double>(sorted.size() - 1));
  std::nth_element(sorted.begin(), most, sorted.end());
  const double sum = std::accumulate(values.begin(), values.end(), 0.0,
                                     [&](double all, double value) { return all + std::min(value, *most); });
  return sum / static_cast<double>(values.size());
}

}  // namespace

IntegratorChosen choose_integrator(const LoadedScene& scene, const RenderRequest& request,
                                   const std::atomic<bool>* stop) {
  const std::span<const std::shared_ptr<Integrator>> choices = integrator_of(scene).choices();
  const uint32_t budget = budget_of(scene, request);
  IntegratorChosen chosen{choices[0], {}};
  double samples = 0;
  for (const auto& choice : choices) {
    chosen.trials.push_back({registered_name(*choice), 0, 0, left_out(*choice, *scene.scene, budget)});
    if (chosen.trials.back().left_out.empty()) samples += kSamples + training_of(*choice);
  }
  const Trials trials(scene, request, samples, stop);
  std::vector<std::optional<Sampled>> all(choices.size());
  for (size_t i = 0; i < choices.size(); ++i) {
    const std::shared_ptr<Integrator> integrator = choices[i]->clone();
    std::string& left_out = chosen.trials[i].left_out;
    try {
      if (left_out.empty()) integrator->prepare(*scene.scene);
    } catch (const Error& error) {  // such as a camera that it does not support
      left_out = error.what();
    }
    if (left_out.empty()) all[i] = trials.sample(*integrator);
    if (stop && stop->load()) return chosen;
  }
  const std::vector<double> weights = weights_of(all, trials.columns());
  double least = 0;
  for (size_t i = 0; i < choices.size(); ++i) {
    if (!all[i]) continue;
    IntegratorTrial& trial = chosen.trials[i];
    trial.variance = relative_variance(*all[i], weights), trial.rays = all[i]->rays;
    const double cost = trial.variance * trial.rays;
    const double limit = chosen.integrator == choices[0] ? kClearlyBetter * least : least;
    if (i > 0 && !(cost < limit)) continue;
    least = cost;
    chosen.integrator = choices[i];
  }
  return chosen;
}

RequestOfChoice request_of_choice(const LoadedScene& scene, const RenderRequest& request,
                                  const std::atomic<bool>* stop) {
  RequestOfChoice of{request, {}, 0};
  if (request.integrator || !scene.integrator || integrator_of(scene).choices().empty()) return of;
  if (!request.load_training.empty())
    throw Error(ErrorCode::kUsage, "`load-training` is for an integrator that is named, not for one that is chosen");
  const Stopwatch watch;
  IntegratorChosen chosen = choose_integrator(scene, request, stop);
  of.request.integrator = std::move(chosen.integrator);
  of.trials = std::move(chosen.trials);
  of.request.attributes[film_key::kTrial] = text_of(registered_name(*of.request.integrator), of.trials);
  take_training(scene, of.request);
  of.seconds = watch.seconds();
  if (request.seconds > 0) of.request.seconds = std::max(0.5 * request.seconds, request.seconds - of.seconds);
  return of;
}

std::string text_of(const std::string& chosen, const std::vector<IntegratorTrial>& trials) {
  std::string text = chosen + ":";
  const double first = trials[0].variance * trials[0].rays;
  for (const IntegratorTrial& trial : trials) {
    const double cost = trial.variance * trial.rays;
    text += fmt::format("{} {} {}", &trial == &trials[0] ? "" : ",", trial.integrator,
                        !trial.left_out.empty() ? "not tried" : fmt::format("{:.2g}", first > 0 ? cost / first : 1));
  }
  return text;
}

}  // namespace covary
