// SPDX-License-Identifier: Apache-2.0
// covary render: a scene to an image, from options to a plan, and from its result to a report.
#include <fmt/format.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "commands.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "core/unfinished.h"
#include "film/display.h"
#include "film/outputs.h"
#include "imageio/output_file.h"
#include "interruption.h"
#include "io/scene_formats.h"
#include "json_output.h"
#include "live.h"
#include "method_options.h"
#include "plans/budget.h"
#include "plans/made_of.h"
#include "plans/pass_files.h"
#include "plans/render.h"
#include "plans/result_files.h"
#include "progress.h"
#include "render_options.h"
#include "render_progress.h"
#include "render_steps.h"
#include "settled_files.h"
#include "stages.h"

namespace covary {
namespace {

constexpr double kPreviewSeconds = 0.5;  // between images for a viewer

void print_light_path(const RenderOptions& options, const LoadedScene& scene) {
  const uint64_t number = replayed_light_path(options);
  const ReplayedLightPath path = replay_light(scene, make_plan(options), make_request(options, scene), number);
  fmt::print("light path {}, {} rays, {} splats\n", number, path.n_rays, path.splats.size());
  for (const LightSplat& splat : path.splats)
    fmt::print("pixel ({}, {}): ({:.9g}, {:.9g}, {:.9g})\n", splat.x, splat.y, splat.value.r, splat.value.g,
               splat.value.b);
}

void print_replay(const RenderOptions& options, const LoadedScene& scene) {
  if (options.replays_light()) return print_light_path(options, scene);
  const std::vector<SampleAddress> addresses = replayed_samples(options);
  const auto samples = replay(scene, make_plan(options), make_request(options, scene), addresses);
  for (size_t i = 0; i < samples.size(); ++i) {
    const SampleAddress& at = addresses[i];
    const ReplayedSample& sample = samples[i];
    if (samples.size() > 1) fmt::print("{}: ", at.sampling == Sampling::kCrn ? "crn" : "independent");
    fmt::print("pixel ({}, {}), sample {}, film position ({}, {}), {} rays\nradiance ({:.9g}, {:.9g}, {:.9g})\n", at.x,
               at.y, at.sample, sample.position.x, sample.position.y, sample.n_rays, sample.value.r, sample.value.g,
               sample.value.b);
  }
}

}  // namespace

RenderResult render_watched(const RenderOptions& options, const LoadedScene& scene, const RenderRequest& request,
                            Display* display, ProgressLine& progress, const StopFlag& stop, LiveRender* live) {
  Stopwatch since_preview;
  RenderProgress shown(options, scene, request, progress);
  RenderCallbacks callbacks;
  callbacks.stop = stop.token();
  callbacks.stage = [&](RenderStage stage) { shown.begin(stage); };
  callbacks.progress = [&](uint64_t done, uint64_t total) { shown.update(done, total); };
  callbacks.predicted = [&](const PredictedError& error) { shown.predicted(error); };
  callbacks.wave = [&](std::span<const Pass> passes) {
    if (!display || !display->ready() || since_preview.seconds() < kPreviewSeconds) return;
    display->update(preview_of(passes));
    since_preview = Stopwatch();
  };
  callbacks.warning = [&](const std::string& text) {
    progress.clear();
    fmt::print(stderr, "warning: {}\n", as_options(text));
  };
  callbacks.resumed = [&](double samples) {
    progress.clear();
    if (!options.quiet)
      fmt::print(stderr, "note: continues with the {} that are kept\n", samples_per_pixel_text(samples));
  };
  const Plan plan = make_plan(options);
  RenderResult result =
      live ? live->render(scene, plan, request, callbacks) : covary::render(scene, plan, request, callbacks);
  progress.finish();
  if (display && !result.passes.empty()) display->update(result.picture());
  return result;
}

namespace {

/// --save-stages, of films of two passes or of one.
void write_stages(const RenderOptions& options, const RenderResult& result) {
  if (options.stages.empty()) return;
  const std::span<const Pass> passes = camera_passes(result.passes);
  const Film &first = passes.front().film, &independent = passes.back().film;
  const bool is_pair = passes.size() > 1;
  MethodSettings settings;
  settings.crn_samples = std::llround(first.mean_count());
  if (!result.aovs.empty()) settings.features = {&result.aovs.at("Albedo"), &result.aovs.at("N")};
  save_stages(
      options.stages, estimator_of(options),
      {is_pair ? rows_of(first, 0, first.height()) : GroupedImage{}, rows_of(independent, 0, independent.height())},
      settings, {first.frame_width(), first.frame_height(), first.crop()});
}

std::string interruption(const RenderReport& report) {
  const auto& [options, scene, result, load_seconds, threads, last_phase] = report;
  if (result.kept.empty()) {
    const bool in_samples = last_phase == name_of(RenderStage::kRendering, "");
    return fmt::format("interrupted {}before the first sample of the picture; nothing was written",
                       in_samples ? "" : fmt::format("during {}, ", last_phase));
  }
  return fmt::format(
      "interrupted after {:.1f} of {:g} samples per pixel; '{}' is the image so far{}; the same command "
      "with --resume continues{}",
      result.samples_per_pixel(), result.camera_sum([](const Pass& p) { return p.settings.spp.mean(); }),
      options.request().output,
      result.kept == options.request().output ? "" : ", '" + result.kept + "' holds its films",
      result.image.estimate.data.empty() && options.settings.denoising.denoises() ? ", and denoises it" : "");
}

}  // namespace

void report(const RenderReport& report, const StopFlag& stop, const std::string& frame) {
  const auto& [options, scene, result, load_seconds, threads, last_phase] = report;
  for (const Pass& pass : result.passes) report_bad_samples(options, pass);
  if (!options.json.empty()) write_text_output(options.json, json_text(statistics(report)));
  if (result.interrupted) throw Unfinished(stop.exit_code(), interruption(report));
  if (result.preview_stops != 0 && options.request().exposure == kAutomaticExposure)
    fmt::print(stderr, "note: '{}' is exposed by {:+g} stops, or much of it would be burnt or black (--exposure)\n",
               preview_path(options.request().output), result.preview_stops);
  if (!options.quiet) frame.empty() ? print_summary(report) : print_frame(report, frame);
  const std::string until = options.values.contains("until") ? options.values.at("until") : "of the live page";
  const std::string doubt = result.predicted ? result.predicted->doubt : "";
  if (!doubt.empty() && result.until_reached.value_or(false))
    fmt::print(stderr, "warning: --until {} was reached, but the predicted error is unreliable: {}\n", until, doubt);
  if (!result.until_reached.value_or(true))
    throw Unfinished(
        kTargetMissed,
        fmt::format(
            "--until {} was not reached: '{}' has a predicted relMSE of {:.3g}{} after {:.4g} samples per "
            "pixel{}",
            until, options.request().output, result.predicted->relmse,
            options.request().until_in_blocks ? fmt::format(", {:.3g} in blocks,", result.predicted_blocks) : "",
            result.samples_per_pixel(), doubt.empty() ? "" : "; that is unreliable: " + doubt));
  if (std::any_of(result.passes.begin(), result.passes.end(), [](const Pass& p) { return p.misses_error; }))
    throw Unfinished(kTargetMissed,
                     fmt::format("--until {} was not reached: '{}' has {:.4g} samples per pixel, as many as --spp, "
                                 "--time and --max-spp allow, and some pixels need more",
                                 until, options.request().output, result.samples_per_pixel()));
}

Outputs files_of(const RenderOptions& options) {
  Outputs outputs;
  outputs.reads(options.scene);
  outputs.writes("--json", options.json, OutputKind::kText);
  if (!options.request().save_training.empty())
    outputs.writes("--save-training", options.request().save_training, OutputKind::kText);
  if (options.is_replay()) return outputs;
  outputs.writes_result("-o", options.request().output, OutputKind::kFilm, "render", options.request().overwrite);
  if (output_target(options.request().output).is_special)
    throw Error(ErrorCode::kUsage,
                fmt::format("-o '{}' is not a regular file, which a render needs to continue after an "
                            "interruption",
                            options.request().output));
  if (std::filesystem::is_directory(options.request().passes))
    for (const char* name : {"crn", "first-1", "independent", "pilot-1", "light"}) {
      const std::string path = (std::filesystem::path(options.request().passes) / name).string();
      outputs.writes("--passes", path + ".exr", OutputKind::kFilm);
      outputs.writes("--passes", path + ".json", OutputKind::kText);
    }
  if (options.request().preview)
    outputs.writes_derived_png("the preview", preview_path(options.request().output),
                               "use --no-preview, or another name for -o");
  return outputs;
}

std::unique_ptr<Display> display_of(const RenderOptions& options) {
  if (options.display_server.empty()) return nullptr;
  return std::make_unique<Display>(options.display_server, options.request().output, [](const std::string& text) {
    // On a terminal, overwrites the progress line.
    fmt::print(stderr, "{}warning: {}\n", isatty(2) == 1 ? "\r\033[K" : "", text);
  });
}

void warn_of_scene(const RenderOptions& options, const LoadedScene& scene) {
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", as_options(warning));
  if (const std::string text = advice(options.settings, estimator_of(options), scene);
      !text.empty() && !options.is_replay() && !options.quiet)
    fmt::print(stderr, "note: {}\n", as_options(text));
  const auto given = [&](const char* option) { return options.values.contains(option); };
  if (given("sampling") && !given("estimator") && !given("denoise") && !options.is_replay() && !options.quiet)
    fmt::print(stderr, "note: --sampling renders a single pass without --denoise\n");
}

namespace {

/// Whether --resume finds the complete picture, or one that has the wanted error already; says so.
bool is_there(const RenderOptions& options, const RenderRequest& request) {
  if (!request.resume || !request.passes.empty() || !options.json.empty() || !options.stages.empty()) return false;
  std::error_code ignored;
  const std::filesystem::path films = passes_folder(request);
  if (std::filesystem::exists(films, ignored)) return false;  // of a later render that was interrupted
  const MadeFile file = made_file(request.output);
  const std::string& made_of = request.attributes.at(film_key::kMadeOf);
  const bool is_same = file.complete && !file.made_of.empty() && differences(file.made_of, made_of).empty();
  if (!is_same && !reaches(file, made_of, relmse_goal(request))) return false;
  if (const std::string damage = damage_of(request.output); !damage.empty()) {
    fmt::print(stderr, "warning: {}; the picture is rendered again\n", damage);
    return false;
  }
  const std::string error = file.predicted ? fmt::format(", with a predicted relMSE of {:.3g}", *file.predicted) : "";
  if (!options.quiet)
    fmt::print(stderr, "{}: complete{}; nothing to render (--overwrite instead of --resume renders it again)\n",
               request.output, error);
  return true;
}

/// Tells the page, if there is one, how the render has ended, whatever ends it.
struct PageEnd {
  LiveRender* live;
  std::string text = "The render has failed; its terminal says why.";
  ~PageEnd() {
    if (live) live->end(text);
  }
};

/// Reports, and returns how far an image is from what was asked for if it is complete nevertheless. A render that was
/// ended on its page has succeeded.
std::optional<Unfinished> report_with_page(const RenderReport& of, const StopFlag& stop, PageEnd& page) {
  page.text = fmt::format("'{}' is complete.", of.options.request().output);
  try {
    report(of, stop);
  } catch (const Unfinished& unfinished) {
    page.text = unfinished.what();
    if (unfinished.exit_code() == kTargetMissed) return unfinished;
    if (!page.live || !page.live->stopped_here()) throw;
    page.text = "stopped" + page.text.substr(std::min(page.text.find(' '), page.text.size()));
    fmt::print(stderr, "{}\n", page.text);
  }
  if (stop.is_set() && !(page.live && page.live->stopped_here()))
    throw Unfinished(stop.exit_code(), fmt::format("interrupted when '{}' was written", of.options.request().output));
  return std::nullopt;
}

void render(RenderOptions options) {
  check_options(options);
  check_live(options);
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));
  if (options.sequence.is_sequence() && !options.is_replay()) return render_sequence(options, threads);
  if (options.sequence.is_sequence()) take_frame(options);

  Outputs outputs = files_of(options);
  const std::unique_ptr<Display> display = display_of(options);
  const std::unique_ptr<LiveRender> live = live_of(options);
  PageEnd page{live.get()};
  ProgressLine progress(std::filesystem::path(options.scene).stem().string(), options.quiet);
  progress.begin("loading");
  const Stopwatch load_watch;
  LoadedScene scene = load(options);
  const double load_seconds = load_watch.seconds() - scene.scene->build_seconds();
  outputs.reads(scene.files);
  progress.clear();
  warn_of_scene(options, scene);
  if (options.is_replay()) {
    progress.finish();
    if (options.sequence.is_sequence()) place_frame(options, scene);
    return print_replay(options, scene);
  }
  const RenderRequest request = make_request(options, scene);
  if (!live && is_there(options, request)) return progress.finish();
  std::optional<StopFlag> stop(std::in_place);
  const RenderResult result = render_watched(options, scene, request, display.get(), progress, *stop, live.get());
  const std::optional<Unfinished> missed =
      report_with_page({options, scene, result, load_seconds, threads, progress.phase()}, *stop, page);
  stop.reset();  // there is nothing more to save
  if (result.complete) write_stages(options, result);
  if (missed) throw *missed;
}

}  // namespace

void add_render(CLI::App& app) {
  const auto o = std::make_shared<RenderOptions>();
  CLI::App* command =
      app.add_subcommand("render", fmt::format("Render a scene ({}) into an image (EXR)", scene_format_names(", ")));
  add_render_options(*command, *o);
  command->callback([o] { render(*o); });
}

}  // namespace covary
