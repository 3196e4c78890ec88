// SPDX-License-Identifier: Apache-2.0
// What a render tells its user at the end: what was written, where the time went, how good it is, what would help next.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "core/number_text.h"
#include "core/shell_text.h"
#include "film/splat_layer.h"
#include "method_options.h"
#include "phase_times.h"
#include "plans/integrator_trial.h"
#include "plans/result_files.h"
#include "progress.h"
#include "render_progress.h"
#include "render_steps.h"
#include "risk_report.h"
#include "video.h"

namespace covary {
namespace {

/// The error of a result falls like samples^-p: of means, of control variates, and of denoised images (measured on ten
/// scenes from 16 to 64 samples: docs/notes/denoising.md, docs/methods/iicv.md).
constexpr double kFallOfMeans = 1, kFallOfPairs = 0.75, kFallOfDenoised = 0.5;
/// Most of the time, and a render for which it matters.
constexpr double kMuchOfTime = 0.6;  // of --time, that is used
constexpr double kMostOfTheTime = 0.5, kLongSeconds = 5;

double fall_of(const RenderOptions& options) {
  if (options.settings.denoising.denoises()) return kFallOfDenoised;
  return estimator_of(options).pair() ? kFallOfPairs : kFallOfMeans;
}

/// "; `--resume --spp 64` halves it", "; a new render of `--spp 64` leaves about 2.8 %" where samples are not kept;
/// empty if so many samples are too many.
std::string more_samples(const RenderReport& report, double relmse) {
  const double samples = std::round(report.result.samples_per_pixel());
  if (samples < 1 || 4 * samples > kMaxSamples || report.options.request().until > 0) return "";
  const double factor = std::pow(4, -fall_of(report.options) / 2);
  const bool keeps_samples = !report.options.request().passes.empty() || report.result.image.estimate.data.empty();
  const std::string what = fmt::format(
      fmt::runtime(keeps_samples ? "; `--resume --spp {:g}`" : "; a new render of `--spp {:g}`"), 4 * samples);
  if (factor <= 0.5) return what + " halves it";
  return fmt::format("{} leaves about {}", what, percent_text(relmse * factor * factor));
}

std::string samples_text(const RenderResult& result) {
  std::string passes;
  for (const Pass& pass : camera_passes(result.passes))
    passes += fmt::format("{}{:g} {}", passes.empty() ? " (" : " + ", pass.film.mean_count(), pass.plan.name);
  const bool several = camera_passes(result.passes).size() > 1;
  std::string text = samples_per_pixel_text(result.samples_per_pixel()) + (several ? passes + ")" : "");
  if (const Pass* light = light_pass(result.passes))
    text += fmt::format(" + {} light paths", format_count(static_cast<double>(light_paths(light->film))));
  return text;
}

constexpr double kMostlyBlack = 0.9;

/// The share of values that are black in the samples and, beside its mean, in the picture.
double black_share(const RenderResult& result) {
  constexpr double kBlack = 0.01;
  const std::vector<float>& picture = result.image.estimate.data;
  const std::vector<float> samples = result.passes[0].film.mean_image().data;
  const double n_values = static_cast<double>(picture.size());
  const double mean = std::accumulate(picture.begin(), picture.end(), 0.0) / n_values;
  size_t n_black = 0;
  for (size_t i = 0; i < picture.size(); ++i) n_black += samples[i] == 0 && picture[i] <= kBlack * mean;
  return picture.empty() ? 0 : static_cast<double>(n_black) / n_values;
}

std::string quality_text(const RenderReport& report) {
  const RenderResult& result = report.result;
  if (!result.predicted) return "unknown, as no error is predicted here";
  const double black = black_share(result);
  if (black == 1) return "the picture is black: the camera sees nothing that is lit";
  const Quality quality(*result.predicted, result.image.risks, result.predicted_blocks);
  const char* asked = result.until_reached.value_or(false) ? ", as asked by --until" : "";
  return (black < kMostlyBlack ? ""
                               : fmt::format("{:.0f} % of the picture is black, as if the camera saw next to nothing "
                                             "that is lit; of the whole, ",
                                             std::floor(100 * black))) +
         quality.text + asked + more_samples(report, quality.relmse);
}

/// What to do for a better picture; empty if there is nothing in particular.
std::string next_text(const RenderReport& report, const PhaseTimes& times) {
  const RenderOptions& o = report.options;
  const RenderResult& result = report.result;
  if (!missing_network(o.settings.denoising).empty() || o.sequence.is_sequence()) return "";  // it is said
  if (result.of_time) return fmt::format("`{}` instead of --time makes the same image", result.of_time->text());
  const bool is_fixed =
      times.auxiliary + times.estimate > kMostOfTheTime * times.total() && times.total() > kLongSeconds;
  if (is_fixed && result.predicted && o.request().until <= 0)
    return fmt::format(
        "`--spp {:g} --overwrite` takes much less than four times as long: most of this time was not for samples",
        4 * std::round(result.samples_per_pixel()));
  if (!o.request().passes.empty())
    return fmt::format("`--resume --spp {:g}` adds to the samples in {}", 4 * std::round(result.samples_per_pixel()),
                       shell_text({o.request().passes}));
  if (!result.predicted || !result.predicted->doubt.empty() || o.request().until > 0) return "";
  return fmt::format("`--until relmse={:.2g} --overwrite`{} renders until half of it is left",
                     result.predicted->relmse / 4, o.request().spp > 0 ? " instead of --spp" : "");
}

void print_training(const RenderResult& result) {
  if (const IntegratorReport of = result.integrator->report(); !of.summary.empty())
    fmt::print(stderr, "{} in {:.2f} s\n", of.summary, result.seconds.train);
}

/// Behind --verbose: speeds, integrator, estimator, and the predicted error with its interval.
void print_details(const RenderReport& report) {
  const auto& [options, scene, result, load_seconds, threads, last_phase] = report;
  const double seconds = std::max(result.render_seconds(), 1e-9);
  fmt::print(stderr, "load {:.2f} s, build {:.2f} s, render {:.2f} s ({} samples/s, {} rays/s)\n", load_seconds,
             scene.scene->build_seconds(), result.render_seconds(),
             format_count(result.camera_sum([](const Pass& p) { return p.result.n_samples; }) / seconds),
             format_count(result.sum([](const Pass& p) { return p.result.n_rays; }) / seconds));
  if (result.trials.empty()) print_training(result);
  const Method estimator = estimator_of(options);
  if (!estimator.is_mean())
    fmt::print(stderr, "{}{} in {:.2f} s\n", estimator.text,
               estimator.network.empty() ? "" : " with " + estimator.network, result.estimate_seconds());
  if (result.predicted) fmt::print(stderr, "{}\n", prediction_text(*result.predicted, result.image.risks));
}

void print_warnings(const RenderReport& report) {
  const RenderResult& result = report.result;
  for (const std::string& warning : result.integrator->report().warnings)
    fmt::print(stderr, "warning: {}\n", as_options(warning));
  print_notes(report.options.settings.denoising, result.image.note);
  const double limit = report.options.request().seconds;
  if (limit > 0 && result.seconds.limited > 1.1 * limit)
    fmt::print(stderr, "warning: --time {:g} was exceeded: {:.2f} s for {}\n", limit, result.seconds.limited,
               samples_per_pixel_text(result.samples_per_pixel()));
  if (result.of_time && !result.interrupted && result.seconds.limited < kMuchOfTime * limit &&
      report.options.request().until == 0)
    fmt::print(
        stderr,
        "note: {:.2g} of --time {:g} s are left: by the trials, more samples did not fit; on a machine that does "
        "other work, they may mislead\n",
        limit - result.seconds.limited, limit);
}

}  // namespace

PhaseTimes phase_times(const RenderReport& report) {
  return phase_times(report.result, report.load_seconds, report.scene.scene->build_seconds());
}

void print_summary(const RenderReport& report) {
  const auto& [options, scene, result, load_seconds, threads, last_phase] = report;
  const RenderRequest& request = options.request();
  const PhaseTimes times = phase_times(report);
  if (options.verbose) print_details(report);
  if (!result.trials.empty()) {  // what became of the samples that are missing
    fmt::print(stderr, "integrator {} (variance x rays)\n", text_of(result.chosen, result.trials));
    print_training(result);
  }
  print_warnings(report);
  fmt::print(stderr, "{}: {} x {} pixels, {}{}\n", request.output, result.passes[0].film.width(),
             result.passes[0].film.height(), samples_text(result),
             request.preview ? "; " + preview_path(request.output) + " to look at" : "");
  fmt::print(stderr, "time: {}{}\nhow good: {}\n", text_of(times, estimate_name(options)),
             result.resumed_samples > 0 ? " (of all calls)" : "", quality_text(report));
  if (const std::string next = next_text(report, times); !next.empty()) fmt::print(stderr, "next: {}\n", next);
}

void print_frame(const RenderReport& report, const std::string& frame) {
  if (report.options.verbose) print_details(report);
  print_warnings(report);
  const PhaseTimes times = phase_times(report);
  fmt::print(stderr, "{}: {}{} in {}{}\n", frame, report.options.request().output,
             report.options.settings.denoising.history.before ? ", with the frame before," : "",
             seconds_text(times.total() - times.loading), report.result.predicted ? "; " + quality_text(report) : "");
}

void print_frames(const RenderOptions& options, int n_made, int n_frames, const PhaseTimes& times) {
  const std::string& output = options.request().output;
  const std::string made = n_made == n_frames ? counted(static_cast<size_t>(n_frames), "frame")
                                              : fmt::format("{} of {} frames; the others were there", n_made, n_frames);
  fmt::print(stderr, "{}: {}\ntime: {}\n", output, made, text_of(times, estimate_name(options)));
  if (n_frames > 1)
    fmt::print(stderr, "next: `covary convert {} {}` makes a video{}\n", shell_text({output}), "video.mp4",
               is_ffmpeg_installed() ? "" : ", with ffmpeg, which is not installed");
}

}  // namespace covary
