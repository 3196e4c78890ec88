// SPDX-License-Identifier: Apache-2.0
// covary render: a scene to an image, by a plan: one or two passes, and the estimator that makes the image of them.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <atomic>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "commands.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "defines.h"
#include "estimators/mean.h"
#include "estimators/predicted_error.h"
#include "estimators/result_file.h"
#include "film/display.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "film/output_file.h"
#include "integrators/aov.h"
#include "io/load_scene.h"
#include "progress.h"
#include "render_options.h"
#include "render_passes.h"
#include "render_report.h"

namespace covary {
namespace {

constexpr double kPreviewSeconds = 0.5;  // between images for a viewer
constexpr int kTrialRows = 64;           // at least, where the time of the estimate is found out
constexpr uint32_t kFirstBudget = 96;    // samples per pixel before --until looks at the error for the first time

std::shared_ptr<Integrator> make_integrator(Parameters& parameters, const RenderOptions& options) {
  PathLengthSettings lengths = PathLengthSettings::from(parameters);
  if (options.min_depth) lengths.min_depth = *options.min_depth;
  if (options.max_depth)
    lengths.max_depth = *options.max_depth < 0 ? PathLengthSettings::kUnlimited : *options.max_depth;
  const IntegratorPlugin* plugin = find_integrator(options.integrator.empty() ? parameters.type() : options.integrator);
  if (plugin) return plugin->make(parameters, lengths);
  parameters.error(unknown_integrator(parameters.type()));
  return nullptr;
}

LoadedScene load(const RenderOptions& options) {
  LoadOptions load_options;
  load_options.defines = parse_defines(options.defines);
  if (!options.resolution.empty()) {
    const auto size = parse_numbers("--resolution", options.resolution, 'x', 2, "WIDTHxHEIGHT, e.g. 1280x720");
    if (size[0] < 1 || size[1] < 1 || size[0] > 65536 || size[1] > 65536)
      throw Error(ErrorCode::kUsage, "--resolution '" + options.resolution + "': each side must be 1 to 65536");
    load_options.width = static_cast<int>(size[0]), load_options.height = static_cast<int>(size[1]);
  }
  load_options.make_integrator = [&](Parameters& parameters) { return make_integrator(parameters, options); };
  return load_scene(options.scene, load_options);
}

std::atomic<bool> g_stop{false};

extern "C" void on_signal(int signal) {
  g_stop = true;
  std::signal(signal, SIG_DFL);  // a second one ends the program at once
}

/// The image that the estimator makes of rows first_row … first_row + n_rows - 1 of the passes.
EstimatorResult estimate_rows(const RenderOptions& options, const std::vector<Pass>& passes, int first_row,
                              int n_rows) {
  const auto rows = [&](const Film& film) {
    return GroupedImage{film.width(), n_rows, film.groups(), film.groups_of(0, first_row)};
  };
  if (options.has_one_pass()) return mean_of_groups(rows(passes[0].film));
  const auto crn_samples = static_cast<int64_t>(std::llround(passes[0].film.mean_count()));
  return make_estimator(options.estimator, predicts_error(options.estimator.name), crn_samples)
      .apply(rows(passes[0].film), rows(passes[1].film));
}

/// Makes the image of the passes, or of a plain pass its standard error; returns the seconds it took.
double estimate(const RenderOptions& options, Outcome& outcome) {
  const Stopwatch watch;
  outcome.image = estimate_rows(options, outcome.passes, 0, outcome.passes[0].film.height());
  if (!outcome.image.std_error.data.empty()) outcome.predicted_relmse = predicted_relmse(outcome.image);
  const double seconds = watch.seconds();
  outcome.estimate_seconds += seconds;
  return seconds;
}

/// Seconds that the estimate will take, from a trial on rows in the middle: it depends on sizes, not on samples.
double time_estimate(const RenderOptions& options, Outcome& outcome) {
  if (options.has_one_pass()) return 0;  // a mean
  const Stopwatch watch;
  const int height = outcome.passes[0].film.height(), n_rows = std::min(height, std::max(kTrialRows, height / 8));
  estimate_rows(options, outcome.passes, (height - n_rows) / 2, n_rows);
  const double seconds = watch.seconds();
  outcome.trial_seconds += seconds;
  return seconds * height / n_rows;
}

/// A picture for a viewer while the passes go on: the mean of all samples so far.
Image preview_of(const std::vector<Pass>& passes) {
  Image image = passes[0].film.mean_image();
  double samples = passes[0].film.mean_count();
  for (size_t i = 1; i < passes.size(); ++i) {
    const Image next = passes[i].film.mean_image();
    samples += passes[i].film.mean_count();
    const auto part = static_cast<float>(passes[i].film.mean_count() / std::max(samples, 1.0));
    for (size_t k = 0; k < image.data.size(); ++k) image.data[k] += part * (next.data[k] - image.data[k]);
  }
  return image;
}

/// The next budget on the way to a relMSE of `target`: error falls like 1 / samples, or more slowly.
uint32_t next_budget(uint32_t budget, double predicted, double target, uint32_t limit) {
  const double factor = std::clamp(1.1 * predicted / target, 1.25, 4.0);
  return static_cast<uint32_t>(std::min<double>(limit, std::ceil(factor * budget)));
}

/// Renders and estimates, once or until the predicted error is small enough. `watch` began with the time that --time limits.
/// False when interrupted.
bool run(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator, uint32_t budget,
         uint32_t limit, const Stopwatch& watch, Display* display, Outcome& outcome) {
  const double target = options.until.empty() ? 0 : parse_until(options.until);
  Stopwatch since_checkpoint, since_preview;
  std::optional<double> estimate_seconds;  // what the next estimate takes
  const auto seconds_left = [&] {
    if (!estimate_seconds) estimate_seconds = time_estimate(options, outcome);
    return options.seconds - watch.seconds() - *estimate_seconds;
  };
  for (;;) {
    ProgressLine progress(std::filesystem::path(options.scene).stem().string(), options.quiet);
    const double progress_seconds = options.seconds > 0 ? std::max(options.seconds - watch.seconds(), 1e-3) : 0;
    RenderLimits limits;
    if (options.seconds > 0) limits.seconds_left = seconds_left;
    limits.stop = &g_stop;
    limits.progress = [&](uint64_t done, uint64_t total) {
      progress.update(done, options.seconds > 0 && !options.spp ? 0 : total, progress_seconds);
    };
    limits.checkpoint = [&] {
      if (display && display->ready() && since_preview.seconds() >= kPreviewSeconds) {
        display->update(preview_of(outcome.passes));
        since_preview = Stopwatch();
      }
      if (options.checkpoint_seconds <= 0 || since_checkpoint.seconds() < options.checkpoint_seconds) return;
      const Stopwatch write_watch;
      save_passes(options, outcome.passes, false);
      outcome.write_seconds += write_watch.seconds();
      since_checkpoint = Stopwatch();
    };
    render_passes(*scene.scene, integrator, outcome.passes, limits);
    progress.finish();
    if (g_stop && !outcome.complete()) return false;
    if (!options.has_one_pass() || target > 0) estimate_seconds = estimate(options, outcome);
    outcome.budget_seconds = watch.seconds();
    const bool out_of_time = options.seconds > 0 && seconds_left() <= 0;
    if (target == 0 || *outcome.predicted_relmse <= target || budget >= limit || out_of_time) return true;
    budget = next_budget(budget, *outcome.predicted_relmse, target, limit);
    set_budget(options, budget, outcome.passes);
  }
}

std::string preview_path(const std::string& output) {
  return std::filesystem::path(output).replace_extension(".png").string();
}

void write_image(const RenderOptions& options, const LoadedScene& scene, Outcome& outcome) {
  Pass& last = outcome.passes.back();
  Film& film = last.film;
  if (options.aovs)
    render_aovs(*scene.scene, last.settings.filter, last.settings.sampling, last.settings.seed, last.settings.pass, 16,
                film);
  if (options.has_one_pass()) {
    film.attributes[film_key::kComplete] = "true";
    write_film(options.output, film);
    if (options.preview) write_png(preview_path(options.output), film.mean_image());
    return;
  }
  std::map<std::string, std::string> attributes;
  for (const char* key :
       {film_key::kSeed, film_key::kSceneHash, film_key::kSettings, film_key::kVersion, film_key::kCommand})
    attributes[std::string("covary:") + key] = film.attributes.at(key);
  attributes["covary:estimator"] = options.estimator.text();
  attributes["covary:samples"] = fmt::format("{:g}", outcome.samples_per_pixel());
  const ImagePlace place{film.frame_width(), film.frame_height(), film.crop()};
  write_result(options.output, place, attributes, outcome.image, film.aovs);
  if (options.preview) write_png(preview_path(options.output), outcome.image.estimate);
}

void replay(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator) {
  const auto at = parse_numbers("--replay", options.replay, ',', 3, "X,Y,SAMPLE, e.g. 640,360,17");
  if (at[0] >= scene.width || at[1] >= scene.height)
    throw Error(ErrorCode::kUsage,
                fmt::format("--replay '{}' is outside the {} x {} frame", options.replay, scene.width, scene.height));
  PassSettings settings;
  settings.sampling = options.sampling == "crn" ? Sampling::kCrn : Sampling::kIndependent;
  settings.seed = options.seed;
  settings.filter = options.rfilter.empty() ? scene.filter : filter_named(options.rfilter);
  const ReplayedSample sample = replay_sample(*scene.scene, integrator, settings, static_cast<int>(at[0]),
                                              static_cast<int>(at[1]), static_cast<uint64_t>(at[2]));
  fmt::print("pixel ({}, {}), sample {}, film position ({}, {}), {} rays\nradiance ({:.9g}, {:.9g}, {:.9g})\n", at[0],
             at[1], at[2], sample.position.x, sample.position.y, sample.n_rays, sample.value.r, sample.value.g,
             sample.value.b);
}

void render(RenderOptions options) {
  check_options(options);
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));

  std::optional<Display> display;
  if (!options.display_server.empty())
    display.emplace(options.display_server, options.output, [](const std::string& text) {
      // On a terminal over the line of progress.
      fmt::print(stderr, "{}warning: {}\n", isatty(2) == 1 ? "\r\033[K" : "", text);
    });

  Outcome outcome;
  const Stopwatch load_watch;
  LoadedScene scene = load(options);
  outcome.load_seconds = load_watch.seconds() - scene.scene->build_seconds();
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", warning);
  const auto& integrator = dynamic_cast<const Integrator&>(*scene.integrator);
  if (!options.replay.empty()) return replay(options, scene, integrator);

  const bool open_ended = options.seconds > 0 || !options.until.empty();
  const uint32_t limit = options.spp.value_or(open_ended ? 1u << 30 : static_cast<uint32_t>(scene.spp));
  const uint32_t budget = options.until.empty() ? limit : std::min(limit, kFirstBudget);
  const Stopwatch watch;
  const uint32_t affordable = affordable_budget(options, scene, integrator, budget);
  if (options.seconds > 0) outcome.trial_seconds = watch.seconds();
  outcome.passes = make_passes(options, scene, integrator, affordable);
  set_budget(options, budget, outcome.passes);
  const double planned = outcome.sum([](const Pass& p) { return p.settings.spp; });
  if (planned != budget && !open_ended)
    fmt::print(stderr, "note: {:g} samples per pixel instead of {}, so that all {} groups have the same size\n",
               planned, budget, outcome.passes[0].film.groups());

  g_stop = false;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  const bool done = run(options, scene, integrator, budget, limit, watch, display ? &*display : nullptr, outcome);
  if (display) display->update(done && !options.has_one_pass() ? outcome.image.estimate : preview_of(outcome.passes));

  const Stopwatch write_watch;
  if (!done || !options.passes.empty()) save_passes(options, outcome.passes, done);
  if (done) {
    write_image(options, scene, outcome);
    remove_passes(options, outcome.passes);
  }
  outcome.write_seconds += write_watch.seconds();

  for (const Pass& pass : outcome.passes) report_bad_samples(options, pass);
  if (!options.json.empty()) {
    const std::string text = statistics(options, scene, outcome, threads).dump(2) + "\n";
    if (options.json == "-")
      fmt::print("{}", text);
    else
      write_text_file(options.json, text);
  }
  if (!done)
    throw Error(
        ErrorCode::kIo,
        fmt::format("interrupted after {:.1f} of {:g} samples per pixel; '{}' holds what was rendered, the same "
                    "command with --resume continues",
                    outcome.samples_per_pixel(), outcome.sum([](const Pass& p) { return p.settings.spp; }),
                    output_is_film(options) ? options.output : passes_folder(options).string()));
  if (!options.quiet) print_summary(options, scene, outcome);
}

}  // namespace

void add_render(CLI::App& app) {
  const auto o = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Render a scene (Mitsuba XML) into an image (EXR)");
  add_render_options(*command, *o);
  command->callback([o] { render(*o); });
}

}  // namespace covary
