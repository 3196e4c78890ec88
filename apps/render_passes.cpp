// SPDX-License-Identifier: Apache-2.0
#include "render_passes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "commands.h"
#include "core/error.h"
#include "core/parallel.h"
#include "core/stopwatch.h"
#include "estimators/grouped_image.h"
#include "estimators/polynomials.h"
#include "film/film_file.h"
#include "film/output_file.h"
#include "integrators/primary_sample.h"

namespace covary {
namespace {

void add(const PassResult& from, PassResult& to) {
  to.n_samples += from.n_samples;
  to.n_rays += from.n_rays;
  to.n_not_finite += from.n_not_finite;
  to.n_negative += from.n_negative;
  to.seconds += from.seconds;
  to.estimate_seconds += from.estimate_seconds;
  to.bad_samples.insert(to.bad_samples.end(), from.bad_samples.begin(), from.bad_samples.end());
}

/// Part of the pass that is done.
double fraction(const Pass& pass) { return static_cast<double>(pass.count) / pass.settings.spp; }

uint64_t samples_left(const Pass& pass) {
  uint64_t left = 0;
  for (uint32_t count : pass.film.counts()) left += pass.settings.spp - std::min(count, pass.settings.spp);
  return left;
}

/// The smallest number of samples a pixel of the film has.
uint32_t smallest_count(const Film& film) { return *std::min_element(film.counts().begin(), film.counts().end()); }

std::string filter_text(const FilterSettings& filter) {
  switch (filter.kind) {
    case FilterKind::kBox:
      return fmt::format("box radius={}", filter.radius);
    case FilterKind::kTent:
      return fmt::format("tent radius={}", filter.radius);
    case FilterKind::kGaussian:
      return fmt::format("gaussian radius={} stddev={}", filter.radius, filter.stddev);
  }
  throw Error(ErrorCode::kInternal, "unknown reconstruction filter");
}

/// How many groups the estimator needs at least.
int fewest_groups(const RenderOptions& options) {
  if (options.has_one_pass()) return 1;
  return options.estimator.name == "iduw" || options.estimator.penalty == Penalty::kCrossFit ? 4 : 3;
}

/// How many groups each pass keeps: 12 as in [YM2025] Sec. 5, or as many as the smaller pass has samples.
int number_of_groups(const RenderOptions& options, uint32_t budget) {
  if (options.has_one_pass())
    return static_cast<int>(options.groups.value_or(options.sampling == "crn" || !options.until.empty() ? 12 : 1));
  const auto parts = parse_split(options.split);
  const auto samples = static_cast<int>(std::min(parts[0], parts[1]) * budget);
  const int fewest = fewest_groups(options);
  const auto groups = static_cast<int>(options.groups.value_or(std::clamp(samples, fewest, 12)));
  if (groups < fewest)
    throw Error(ErrorCode::kUsage,
                fmt::format("--groups {}: --estimator {} needs at least {} groups to measure how pixels "
                            "vary together",
                            groups, options.estimator.name, fewest));
  return groups;
}

std::string costs_path(const Pass& pass) {
  return std::filesystem::path(pass.path).replace_extension(".json").string();
}

/// Puts the film at pass.path in the place of the empty one, which it must match.
void resume(Pass& pass, const RenderOptions& options) {
  const Film empty = std::exchange(pass.film, read_film(pass.path));
  Film& film = pass.film;
  const auto differs = [&](const std::string& what, const std::string& old_value, const std::string& new_value) {
    throw Error(ErrorCode::kInput, fmt::format("--resume: '{}' was rendered with {} {}, this command asks for {}",
                                               pass.path, what, old_value, new_value));
  };
  const auto size_text = [](const Film& f) {
    const CropWindow& c = f.crop();
    return fmt::format("{} x {}, crop {},{},{},{}", f.frame_width(), f.frame_height(), c.x, c.y, c.width, c.height);
  };
  if (size_text(film) != size_text(empty)) differs("frame", size_text(film), size_text(empty));
  // With --time the number of groups depends on the speed: the film's own is as good.
  const bool any_groups = options.seconds > 0 && !options.groups && film.groups() >= fewest_groups(options);
  if (film.groups() != empty.groups() && !any_groups)
    differs("groups", std::to_string(film.groups()), std::to_string(empty.groups()));
  for (const char* key : {film_key::kSceneHash, film_key::kSampling, film_key::kSeed, film_key::kSettings})
    if (film.attributes[key] != empty.attributes.at(key)) differs(key, film.attributes[key], empty.attributes.at(key));
  film.attributes = empty.attributes;
  film.aovs.clear();
  pass.count = smallest_count(film);
  if (options.passes.empty() || !std::filesystem::exists(costs_path(pass))) return;
  std::ifstream file(costs_path(pass));
  const nlohmann::json costs = nlohmann::json::parse(file, nullptr, false);
  if (costs.is_discarded()) return;
  pass.result.n_samples = costs.value("samples", uint64_t{0});
  pass.result.n_rays = costs.value("rays", uint64_t{0});
  pass.result.seconds = costs.value("seconds", 0.0);
  pass.result.estimate_seconds = costs.value("estimate_seconds", 0.0);
}

/// Fits polynomials to the samples of a pixel.
PixelEstimate polynomial_estimate(int dimensions) {
  static_assert(PolynomialsOptions::kMaxDimensions <= kPrimaryDimensions);
  return [dimensions](std::span<const CameraSample> samples) {
    thread_local std::vector<Spectrum> values;
    thread_local std::vector<float> coordinates;
    values.clear();
    for (const CameraSample& sample : samples) values.push_back(sample.radiance);
    primary_coordinates(samples, dimensions, coordinates);
    return polynomials(values, coordinates, dimensions);
  };
}

/// Makes the pass one whose pixels are estimated from all their `samples`.
void set_estimate(const RenderOptions& options, uint32_t samples, Pass& pass) {
  throw_if_any(options.estimator.name, PolynomialsOptions{options.dimensions, samples}.validate());
  pass.settings.estimate = polynomial_estimate(options.dimensions);
  pass.film.attributes["estimator"] = options.estimator.text();
  // The number of samples belongs to the settings: an estimate of few samples cannot become one of more.
  pass.film.attributes[film_key::kSettings] +=
      fmt::format("; polynomials dimensions={} samples={}", options.dimensions, samples);
}

/// Samples per second, from trials all over the window.
double samples_per_second(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator) {
  constexpr int kCells = 8, kSide = 16;  // a square of pixels in each cell of a grid
  const CropWindow window = crop_window(options, scene);
  PassSettings settings;
  settings.spp = 1;
  settings.filter = options.rfilter.empty() ? scene.filter : filter_named(options.rfilter);
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

}  // namespace

CropWindow crop_window(const RenderOptions& options, const LoadedScene& scene) {
  if (options.crop.empty()) return {scene.crop_x, scene.crop_y, scene.crop_width, scene.crop_height};
  const auto c = parse_numbers("--crop", options.crop, ',', 4, "X,Y,WIDTH,HEIGHT in pixels, e.g. 240,560,240,160");
  if (c[2] < 1 || c[3] < 1 || c[0] + c[2] > scene.width || c[1] + c[3] > scene.height)
    throw Error(ErrorCode::kUsage, fmt::format("--crop '{}' does not fit into the {} x {} frame", options.crop,
                                               scene.width, scene.height));
  return {static_cast<int>(c[0]), static_cast<int>(c[1]), static_cast<int>(c[2]), static_cast<int>(c[3])};
}

uint32_t affordable_budget(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator,
                           uint32_t budget) {
  if (options.seconds <= 0 || options.has_one_pass() || options.groups) return budget;
  const CropWindow window = crop_window(options, scene);
  const double samples = 0.5 * options.seconds * samples_per_second(options, scene, integrator);
  return static_cast<uint32_t>(std::min<double>(budget, samples / window.width / window.height));
}

std::filesystem::path passes_folder(const RenderOptions& options) {
  return options.passes.empty() ? std::filesystem::path(options.output).replace_extension(".passes")
                                : std::filesystem::path(options.passes);
}

bool output_is_film(const RenderOptions& options) { return options.has_one_pass() && options.passes.empty(); }

void set_budget(const RenderOptions& options, uint32_t total, std::vector<Pass>& passes) {
  const auto parts = parse_split(options.split);
  for (size_t i = 0; i < passes.size(); ++i) {
    const auto groups = static_cast<uint32_t>(passes[i].film.groups());
    const double part = passes.size() == 1 ? 1.0 : parts[i];
    const auto wanted = static_cast<uint32_t>(std::ceil(part * total - 1e-9));
    passes[i].settings.spp = (std::max(wanted, 1u) + groups - 1) / groups * groups;
  }
}

std::vector<Pass> make_passes(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator,
                              uint32_t budget) {
  std::vector<std::string> names = {"crn", "independent"};
  if (options.has_one_pass()) names = {options.sampling.empty() ? "independent" : options.sampling};
  std::vector<Pass> passes;
  for (const std::string& name : names) {
    Pass pass;
    pass.settings.sampling = name == "crn" ? Sampling::kCrn : Sampling::kIndependent;
    pass.settings.seed = options.seed;
    pass.settings.filter = options.rfilter.empty() ? scene.filter : filter_named(options.rfilter);
    pass.path = output_is_film(options) ? options.output : (passes_folder(options) / (name + ".exr")).string();
    pass.film = Film(scene.width, scene.height, crop_window(options, scene), number_of_groups(options, budget));
    pass.film.attributes = {
        {film_key::kSeed, std::to_string(options.seed)},
        {film_key::kSampling, name},
        {film_key::kSceneHash, scene.content_hash},
        {film_key::kSettings, integrator.description() + "; filter " + filter_text(pass.settings.filter)},
        {film_key::kVersion, COVARY_VERSION},
        {film_key::kCommand, command_line()},
        {film_key::kComplete, "false"},
    };
    if (options.estimates_in_pass()) set_estimate(options, budget, pass);
    if (options.resume && std::filesystem::exists(pass.path)) resume(pass, options);
    passes.push_back(std::move(pass));
  }
  set_budget(options, budget, passes);
  return passes;
}

void save_passes(const RenderOptions& options, std::vector<Pass>& passes, bool complete) {
  if (!output_is_film(options)) std::filesystem::create_directories(passes_folder(options));
  for (Pass& pass : passes) {
    pass.film.attributes[film_key::kComplete] = complete ? "true" : "false";
    write_film(pass.path, pass.film);
    if (options.passes.empty()) continue;
    nlohmann::ordered_json costs = {
        {"samples", pass.result.n_samples}, {"rays", pass.result.n_rays}, {"seconds", pass.result.seconds}};
    if (pass.settings.estimate) costs["estimate_seconds"] = pass.result.estimate_seconds;
    write_text_file(costs_path(pass), costs.dump(2) + "\n");
  }
}

void remove_passes(const RenderOptions& options, const std::vector<Pass>& passes) {
  if (!options.passes.empty() || output_is_film(options)) return;
  std::error_code ignored;
  for (const Pass& pass : passes) std::filesystem::remove(pass.path, ignored);
  std::filesystem::remove(passes_folder(options), ignored);  // only when empty
}

void render_passes(const Scene& scene, const Integrator& integrator, std::vector<Pass>& passes,
                   const RenderLimits& limits) {
  uint64_t total = 0;
  for (const Pass& pass : passes) total += samples_left(pass);
  uint64_t done = 0;
  const auto stopped = [&] { return limits.stop && limits.stop->load(); };
  for (;;) {
    Pass& pass = *std::min_element(passes.begin(), passes.end(),
                                   [](const Pass& a, const Pass& b) { return fraction(a) < fraction(b); });
    if (pass.count >= pass.settings.spp || stopped()) return;
    PassSettings wave = pass.settings;
    wave.spp =
        wave.estimate ? pass.settings.spp : std::min(pass.settings.spp, wave_end(pass.count, pass.film.groups()));
    wave.stop = limits.stop;
    wave.checkpoint = wave.estimate ? limits.checkpoint : nullptr;  // that wave is all there is
    wave.progress = [&](uint64_t now, uint64_t) {
      if (limits.progress) limits.progress(done + now, total);
    };
    if (limits.seconds_left && pass.count > 0) {  // the pass that is farthest behind
      wave.seconds = limits.seconds_left();
      if (wave.seconds <= 0) return;
    }
    const PassResult result = render_pass(scene, integrator, wave, pass.film);
    add(result, pass.result);
    done += result.n_samples;
    if (!result.complete) return;  // interrupted, or out of time
    pass.count = wave.spp;
    pass.result.complete = pass.count >= pass.settings.spp;
    if (limits.checkpoint) limits.checkpoint();
  }
}

}  // namespace covary
