// SPDX-License-Identifier: Apache-2.0
// covary render: a scene to an image, by a plan: one or two passes, and the estimator that makes the image of them.
#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/global_control.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>
#include <utility>

#include "commands.h"
#include "core/error.h"
#include "estimator_options.h"
#include "estimators/mean.h"
#include "estimators/predicted_error.h"
#include "estimators/result_file.h"
#include "film/display.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "film/output_file.h"
#include "integrators/aov.h"
#include "integrators/integrator.h"
#include "io/load_scene.h"
#include "progress.h"
#include "render_passes.h"

namespace covary {
namespace {

using Clock = std::chrono::steady_clock;
constexpr double kPreviewSeconds = 0.5;  // between images for a viewer
constexpr uint32_t kFirstBudget = 96;    // samples per pixel before --until looks at the error for the first time

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct RenderOptions {
  std::string scene, output, integrator, sampling, split = "1:1", rfilter, json, passes;
  std::string resolution, crop, replay, until, display_server;
  EstimatorOptions estimator;
  std::vector<std::string> defines;
  std::optional<uint32_t> spp, groups;
  std::optional<int> min_depth, max_depth;
  uint64_t seed = 0;
  int threads = 0;
  double seconds = 0, checkpoint_seconds = 300;
  bool resume = false, aovs = false, quiet = false, preview = true;
};

// ---- options -------------------------------------------------------------------------------------------------------

/// Whole numbers separated by `separator`; throws a usage error that names the option.
std::vector<int64_t> parse_numbers(const std::string& option, const std::string& text, char separator, size_t count,
                                   const std::string& example) {
  std::vector<int64_t> numbers;
  size_t begin = 0;
  while (begin <= text.size()) {
    const size_t end = std::min(text.find(separator, begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    if (word.empty() || word.size() > 18 || word.find_first_not_of("0123456789") != std::string::npos) break;
    numbers.push_back(std::stoll(word));
    begin = end + 1;
  }
  if (numbers.size() != count || begin <= text.size())
    throw Error(ErrorCode::kUsage, option + " '" + text + "': expected " + example);
  return numbers;
}

std::map<std::string, std::string> parse_defines(const std::vector<std::string>& defines) {
  std::map<std::string, std::string> result;
  for (const std::string& define : defines) {
    const size_t equals = define.find('=');
    if (equals == 0 || equals == std::string::npos)
      throw Error(ErrorCode::kUsage, "-D '" + define + "': expected name=value");
    result[define.substr(0, equals)] = define.substr(equals + 1);
  }
  return result;
}

FilterSettings filter_named(const std::string& name) {
  if (name == "box") return {FilterKind::kBox, 0.5f, 0};
  if (name == "tent") return {FilterKind::kTent, 1.0f, 0};
  return {FilterKind::kGaussian, 2.0f, 0.5f};
}

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

// ---- the scene -----------------------------------------------------------------------------------------------------

const IntegratorPlugin* find_integrator(const std::string& name) {
  for (const IntegratorPlugin& plugin : integrator_plugins())
    if (name == plugin.name) return &plugin;
  return nullptr;
}

std::string unknown_integrator(const std::string& name) {
  std::vector<std::string> names;
  for (const IntegratorPlugin& plugin : integrator_plugins()) names.push_back(plugin.name);
  return fmt::format("unknown integrator '{}'{}; supported: {}", name, did_you_mean(name, names),
                     fmt::join(names, ", "));
}

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

CropWindow crop_window(const RenderOptions& options, const LoadedScene& scene) {
  if (options.crop.empty()) return {scene.crop_x, scene.crop_y, scene.crop_width, scene.crop_height};
  const auto c = parse_numbers("--crop", options.crop, ',', 4, "X,Y,WIDTH,HEIGHT in pixels, e.g. 240,560,240,160");
  if (c[2] < 1 || c[3] < 1 || c[0] + c[2] > scene.width || c[1] + c[3] > scene.height)
    throw Error(ErrorCode::kUsage, fmt::format("--crop '{}' does not fit into the {} x {} frame", options.crop,
                                               scene.width, scene.height));
  return {static_cast<int>(c[0]), static_cast<int>(c[1]), static_cast<int>(c[2]), static_cast<int>(c[3])};
}

// ---- interruption ----------------------------------------------------------------------------------------------------

std::atomic<bool> g_stop{false};

extern "C" void on_signal(int signal) {
  g_stop = true;
  std::signal(signal, SIG_DFL);  // a second one ends the program at once
}

// ---- results -------------------------------------------------------------------------------------------------------

std::string preview_path(const std::string& output) {
  return std::filesystem::path(output).replace_extension(".png").string();
}

double peak_memory_bytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) * 1024;
}

/// Command that repeats one sample of a pass: the user's own, with the sample in place of the outputs.
std::string replay_command(const RenderOptions& o, const Pass& pass, const BadSample& bad) {
  std::string text = "covary render " + o.scene;
  for (const std::string& define : o.defines) text += " -D " + define;
  if (!o.resolution.empty()) text += " --resolution " + o.resolution;
  if (!o.integrator.empty()) text += " --integrator " + o.integrator;
  if (o.min_depth) text += fmt::format(" --min-depth {}", *o.min_depth);
  if (o.max_depth) text += fmt::format(" --max-depth {}", *o.max_depth);
  if (!o.rfilter.empty()) text += " --rfilter " + o.rfilter;
  return text +
         fmt::format(" --sampling {} --seed {} --replay {},{},{}", pass.name(), o.seed, bad.x, bad.y, bad.sample);
}

void report_bad_samples(const RenderOptions& options, const Pass& pass) {
  const PassResult& result = pass.result;
  if (result.bad_samples.empty()) return;
  fmt::print(stderr, "warning: {} samples were not finite and {} negative; they count as black. The first:\n",
             result.n_not_finite, result.n_negative);
  for (const BadSample& bad : result.bad_samples)
    fmt::print(stderr, "  pixel ({}, {}), sample {}: ({}, {}, {})\n    {}\n", bad.x, bad.y, bad.sample, bad.value.r,
               bad.value.g, bad.value.b, replay_command(options, pass, bad));
}

/// What has become of the plan.
struct Outcome {
  std::vector<Pass> passes;
  EstimatorResult image;
  std::optional<double> predicted_relmse;
  double load_seconds = 0, estimate_seconds = 0, write_seconds = 0;

  template <typename F>
  double sum(F value) const {
    double total = 0;
    for (const Pass& pass : passes) total += static_cast<double>(value(pass));
    return total;
  }
  double samples_per_pixel() const {
    return sum([](const Pass& p) { return p.film.mean_count(); });
  }
  double render_seconds() const {
    return sum([](const Pass& p) { return p.result.seconds; });
  }
  bool complete() const {
    return std::all_of(passes.begin(), passes.end(), [](const Pass& p) { return p.count >= p.settings.spp; });
  }
};

nlohmann::ordered_json statistics(const RenderOptions& options, const LoadedScene& scene, const Outcome& outcome,
                                  int threads) {
  const Film& film = outcome.passes.back().film;
  const double samples = outcome.sum([](const Pass& p) { return p.result.n_samples; });
  const double rays = outcome.sum([](const Pass& p) { return p.result.n_rays; });
  const double rate = 1 / std::max(outcome.render_seconds(), 1e-9);
  nlohmann::ordered_json passes = nlohmann::json::array(), bad = nlohmann::json::array();
  for (const Pass& pass : outcome.passes) {
    passes.push_back({{"sampling", pass.name()},
                      {"samples_per_pixel", pass.film.mean_count()},
                      {"groups", pass.film.groups()},
                      {"samples", pass.result.n_samples},
                      {"rays", pass.result.n_rays},
                      {"seconds", pass.result.seconds}});
    for (const BadSample& b : pass.result.bad_samples)
      bad.push_back({{"x", b.x}, {"y", b.y}, {"sample", b.sample}, {"replay", replay_command(options, pass, b)}});
  }
  nlohmann::ordered_json json = {
      {"version", COVARY_VERSION},
      {"command", command_line()},
      {"output", options.output},
      {"scene", options.scene},
      {"scene_hash", scene.content_hash},
      {"width", film.width()},
      {"height", film.height()},
      {"estimator", options.estimator.text()},
      {"samples_per_pixel", outcome.samples_per_pixel()},
      {"seed", options.seed},
      {"threads", threads},
      {"complete", outcome.complete()},
      {"passes", passes},
      {"seconds",
       {{"load", outcome.load_seconds},
        {"build", scene.scene->build_seconds()},
        {"render", outcome.render_seconds()},
        {"estimate", outcome.estimate_seconds},
        {"write", outcome.write_seconds}}},
      {"samples", samples},
      {"rays", rays},
      {"samples_per_second", samples * rate},
      {"rays_per_second", rays * rate},
      {"triangles", scene.scene->n_triangles()},
      {"peak_memory_bytes", peak_memory_bytes()},
      {"not_finite_samples", outcome.sum([](const Pass& p) { return p.result.n_not_finite; })},
      {"negative_samples", outcome.sum([](const Pass& p) { return p.result.n_negative; })},
      {"bad_samples", bad}};
  if (outcome.predicted_relmse) json["predicted_relmse"] = *outcome.predicted_relmse;
  return json;
}

// ---- the plan ------------------------------------------------------------------------------------------------------

bool is_plain(const RenderOptions& options) { return options.estimator.name == "none"; }

/// Parts of the budget for the CRN and the independent pass, "1:3".
std::array<double, 2> parse_split(const std::string& text) {
  const auto parts = parse_numbers("--split", text, ':', 2, "CRN:INDEPENDENT in whole numbers, e.g. 1:1");
  if (parts[0] < 1 || parts[1] < 1 || parts[0] > 1000 || parts[1] > 1000)
    throw Error(ErrorCode::kUsage, "--split '" + text + "': each part must be 1 to 1000");
  const double sum = static_cast<double>(parts[0] + parts[1]);
  return {static_cast<double>(parts[0]) / sum, static_cast<double>(parts[1]) / sum};
}

double parse_until(const std::string& text) {
  const std::string key = "relmse=";
  size_t end = 0;
  double value = 0;
  if (text.starts_with(key)) try {
      value = std::stod(text.substr(key.size()), &end);
    } catch (const std::exception&) {
      end = 0;
    }
  if (end == 0 || key.size() + end != text.size() || !(value > 0) || !std::isfinite(value))
    throw Error(ErrorCode::kUsage, "--until '" + text + "': expected relmse=X with X > 0, e.g. relmse=0.005");
  return value;
}

/// Samples per pixel of each pass for a budget of `total`; the passes' groups are those of the first call.
void set_budget(const RenderOptions& options, uint32_t total, std::vector<Pass>& passes) {
  const auto parts = parse_split(options.split);
  for (size_t i = 0; i < passes.size(); ++i) {
    const auto groups = static_cast<uint32_t>(passes[i].film.groups());
    const double part = passes.size() == 1 ? 1.0 : parts[i];
    const auto wanted = static_cast<uint32_t>(std::ceil(part * total - 1e-9));
    passes[i].settings.spp = (std::max(wanted, 1u) + groups - 1) / groups * groups;
  }
}

/// How many groups each pass keeps: a tenth of the noise in a variance is worth 12 of them; small passes have as many as
/// they have samples.
int number_of_groups(const RenderOptions& options, uint32_t budget) {
  if (is_plain(options))
    return static_cast<int>(options.groups.value_or(options.sampling == "crn" || !options.until.empty() ? 12 : 1));
  const auto parts = parse_split(options.split);
  const double fewest = std::min(parts[0], parts[1]) * budget;
  const auto groups = static_cast<int>(options.groups.value_or(std::clamp(static_cast<int>(fewest), 3, 12)));
  if (groups < 3)
    throw Error(ErrorCode::kUsage,
                fmt::format("--groups {}: --estimator {} needs at least 3 groups to measure how pixels "
                            "vary together",
                            groups, options.estimator.name));
  return groups;
}

/// Where the films are while the plan runs.
std::filesystem::path passes_folder(const RenderOptions& options) {
  return options.passes.empty() ? std::filesystem::path(options.output).replace_extension(".passes")
                                : std::filesystem::path(options.passes);
}

/// A plain render without --passes has its film in the output.
bool output_is_film(const RenderOptions& options) { return is_plain(options) && options.passes.empty(); }

std::string costs_path(const Pass& pass) {
  return std::filesystem::path(pass.path).replace_extension(".json").string();
}

/// Puts the film at pass.path in the place of the empty one, which it must match.
void resume(Pass& pass, bool with_costs) {
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
  if (film.groups() != empty.groups()) differs("groups", std::to_string(film.groups()), std::to_string(empty.groups()));
  for (const char* key : {film_key::kSceneHash, film_key::kSampling, film_key::kSeed, film_key::kSettings})
    if (film.attributes[key] != empty.attributes.at(key)) differs(key, film.attributes[key], empty.attributes.at(key));
  film.attributes = empty.attributes;
  film.aovs.clear();
  pass.count = smallest_count(film);
  if (!with_costs || !std::filesystem::exists(costs_path(pass))) return;
  std::ifstream file(costs_path(pass));
  const nlohmann::json costs = nlohmann::json::parse(file, nullptr, false);
  if (costs.is_discarded()) return;
  pass.result.n_samples = costs.value("samples", uint64_t{0});
  pass.result.n_rays = costs.value("rays", uint64_t{0});
  pass.result.seconds = costs.value("seconds", 0.0);
}

std::vector<Pass> make_passes(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator,
                              uint32_t budget) {
  std::vector<std::string> names = {"crn", "independent"};
  if (is_plain(options)) names = {options.sampling.empty() ? "independent" : options.sampling};
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
    if (options.resume && std::filesystem::exists(pass.path)) resume(pass, !options.passes.empty());
    passes.push_back(std::move(pass));
  }
  set_budget(options, budget, passes);
  return passes;
}

/// Keeps the films, so that --resume can go on from here.
void save_passes(const RenderOptions& options, std::vector<Pass>& passes, bool complete) {
  if (!output_is_film(options)) std::filesystem::create_directories(passes_folder(options));
  for (Pass& pass : passes) {
    pass.film.attributes[film_key::kComplete] = complete ? "true" : "false";
    write_film(pass.path, pass.film);
    if (options.passes.empty()) continue;
    const nlohmann::ordered_json costs = {
        {"samples", pass.result.n_samples}, {"rays", pass.result.n_rays}, {"seconds", pass.result.seconds}};
    write_text_file(costs_path(pass), costs.dump(2) + "\n");
  }
}

/// Films that were kept for --resume alone.
void remove_passes(const RenderOptions& options, const std::vector<Pass>& passes) {
  if (!options.passes.empty() || output_is_film(options)) return;
  std::error_code ignored;
  for (const Pass& pass : passes) std::filesystem::remove(pass.path, ignored);
  std::filesystem::remove(passes_folder(options), ignored);  // only when empty
}

GroupedImage grouped(const Film& film) { return {film.width(), film.height(), film.groups(), film.data().data()}; }

/// Makes the image of the passes.
void estimate(const RenderOptions& options, Outcome& outcome) {
  const auto start = Clock::now();
  const std::vector<Pass>& passes = outcome.passes;
  if (is_plain(options)) {
    outcome.image = mean_of_groups(grouped(passes[0].film));
  } else {
    const auto crn_samples = static_cast<int64_t>(std::llround(passes[0].film.mean_count()));
    outcome.image = make_estimator(options.estimator, predicts_error(options.estimator.name), crn_samples)
                        .apply(grouped(passes[0].film), grouped(passes[1].film));
  }
  if (!outcome.image.std_error.data.empty()) outcome.predicted_relmse = predicted_relmse(outcome.image);
  outcome.estimate_seconds += seconds_since(start);
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

/// Renders and estimates, once or until the predicted error is small enough. False when interrupted.
bool run(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator, uint32_t budget,
         uint32_t limit, Display* display, Outcome& outcome) {
  const double target = options.until.empty() ? 0 : parse_until(options.until);
  const auto start = Clock::now();
  auto last_checkpoint = start, last_preview = start;
  for (;;) {
    ProgressLine progress(std::filesystem::path(options.scene).stem().string(), options.quiet);
    RenderLimits limits;
    limits.seconds = options.seconds > 0 ? std::max(options.seconds - seconds_since(start), 1e-3) : 0;
    limits.stop = &g_stop;
    limits.progress = [&](uint64_t done, uint64_t total) {
      progress.update(done, options.seconds > 0 && !options.spp ? 0 : total, limits.seconds);
    };
    limits.checkpoint = [&] {
      if (display && display->ready() && seconds_since(last_preview) >= kPreviewSeconds) {
        display->update(preview_of(outcome.passes));
        last_preview = Clock::now();
      }
      if (options.checkpoint_seconds <= 0 || seconds_since(last_checkpoint) < options.checkpoint_seconds) return;
      save_passes(options, outcome.passes, false);
      last_checkpoint = Clock::now();
    };
    render_passes(*scene.scene, integrator, outcome.passes, limits);
    progress.finish();
    if (g_stop && !outcome.complete()) return false;
    if (!is_plain(options) || target > 0) estimate(options, outcome);
    const bool out_of_time = options.seconds > 0 && seconds_since(start) >= options.seconds;
    if (target == 0 || *outcome.predicted_relmse <= target || budget >= limit || out_of_time) return true;
    budget = next_budget(budget, *outcome.predicted_relmse, target, limit);
    set_budget(options, budget, outcome.passes);
  }
}

// ---- output ----------------------------------------------------------------------------------------------------------

void write_image(const RenderOptions& options, const LoadedScene& scene, Outcome& outcome) {
  Pass& last = outcome.passes.back();
  Film& film = last.film;
  if (options.aovs)
    render_aovs(*scene.scene, last.settings.filter, last.settings.sampling, last.settings.seed, last.settings.pass, 16,
                film);
  if (is_plain(options)) {
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

void print_summary(const RenderOptions& options, const LoadedScene& scene, const Outcome& outcome) {
  std::string samples;
  for (const Pass& pass : outcome.passes)
    samples += fmt::format("{}{:g} {}", samples.empty() ? "" : " + ", pass.film.mean_count(), pass.name());
  const double seconds = std::max(outcome.render_seconds(), 1e-9);
  fmt::print(stderr,
             "{}: {} x {}, {} samples per pixel in {:.2f} s (load {:.2f} s, build {:.2f} s, {} samples/s, {} rays/s)\n",
             options.output, outcome.passes[0].film.width(), outcome.passes[0].film.height(), samples, seconds,
             outcome.load_seconds, scene.scene->build_seconds(),
             format_count(outcome.sum([](const Pass& p) { return p.result.n_samples; }) / seconds),
             format_count(outcome.sum([](const Pass& p) { return p.result.n_rays; }) / seconds));
  if (!is_plain(options)) {
    fmt::print(stderr, "{} in {:.2f} s", options.estimator.text(), outcome.estimate_seconds);
    if (outcome.predicted_relmse) fmt::print(stderr, ", predicted relMSE {:.3g}", *outcome.predicted_relmse);
    fmt::print(stderr, "\n");
  } else if (!options.until.empty()) {
    fmt::print(stderr, "predicted relMSE {:.3g}\n", *outcome.predicted_relmse);
  }
  if (!options.until.empty() && *outcome.predicted_relmse > parse_until(options.until))
    fmt::print(stderr, "warning: --until {} was not reached\n", options.until);
}

void check_output_writable(const std::string& output) {
  const std::filesystem::path folder = std::filesystem::absolute(output).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw Error(ErrorCode::kIo, "cannot write '" + output + "': the folder '" + folder.string() + "' does not exist");
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

/// Everything that can be wrong before the scene is loaded.
void check_options(RenderOptions& options) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  if (options.replay.empty() && options.output.empty())
    usage("no output given; use -o OUT.exr (or --replay X,Y,SAMPLE)");
  if (!options.integrator.empty() && !find_integrator(options.integrator))
    usage("--integrator: " + unknown_integrator(options.integrator));
  if (!options.sampling.empty() && options.estimator.command->count("--estimator") && !is_plain(options))
    usage(fmt::format(
        "--sampling is an option of --estimator none; {} renders one pass with common random numbers and one "
        "with independent ones",
        options.estimator.name));
  if (!options.sampling.empty()) options.estimator.name = "none";
  if (is_plain(options) && options.estimator.command->count("--split"))
    usage("--split is an option of estimators with two passes, not of none");
  parse_split(options.split);
  if (!options.until.empty()) {
    parse_until(options.until);
    if (!is_plain(options) && !predicts_error(options.estimator.name))
      usage("--until: " + options.estimator.name + " does not estimate its error");
    if (is_plain(options) && options.groups.value_or(2) < 2) usage("--until needs --groups 2 or more");
  }
  check_estimator_options(options.estimator);
  if (!options.output.empty()) check_output_writable(options.output);
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
  const auto load_start = Clock::now();
  LoadedScene scene = load(options);
  outcome.load_seconds = seconds_since(load_start) - scene.scene->build_seconds();
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", warning);
  const auto& integrator = dynamic_cast<const Integrator&>(*scene.integrator);
  if (!options.replay.empty()) return replay(options, scene, integrator);

  const bool open_ended = options.seconds > 0 || !options.until.empty();
  const uint32_t limit = options.spp.value_or(open_ended ? 1u << 30 : static_cast<uint32_t>(scene.spp));
  const uint32_t budget = options.until.empty() ? limit : std::min(limit, kFirstBudget);
  outcome.passes = make_passes(options, scene, integrator, budget);
  const double planned = outcome.sum([](const Pass& p) { return p.settings.spp; });
  if (planned != budget && !open_ended)
    fmt::print(stderr, "note: {:g} samples per pixel instead of {}, so that all {} groups have the same size\n",
               planned, budget, outcome.passes[0].film.groups());

  g_stop = false;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  const bool done = run(options, scene, integrator, budget, limit, display ? &*display : nullptr, outcome);
  if (display) display->update(done && !is_plain(options) ? outcome.image.estimate : preview_of(outcome.passes));

  const auto write_start = Clock::now();
  if (!done || !options.passes.empty()) save_passes(options, outcome.passes, done);
  if (done) {
    write_image(options, scene, outcome);
    remove_passes(options, outcome.passes);
  }
  outcome.write_seconds = seconds_since(write_start);

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
  command->add_option("SCENE", o->scene, "Scene file, Mitsuba XML")->required();
  command->add_option("-o,--output", o->output, "The image (EXR); a PNG preview appears beside it");
  command->add_option("--spp", o->spp, "Samples per pixel of all passes together; default: the scene's")
      ->check(CLI::Range(1u, 1u << 30));
  command->add_option("--integrator", o->integrator, "Integrator instead of the scene's: path");
  command
      ->add_option("--estimator", o->estimator.name,
                   "How passes become the image: iicv, cv-baseline or iduw of a pass with common random numbers and an "
                   "independent one, or none: the mean of a single pass")
      ->check(CLI::IsMember({"iicv", "cv-baseline", "iduw", "none"}))
      ->capture_default_str();
  command->add_option("--split", o->split, "CRN:INDEPENDENT, parts of the samples for the two passes")
      ->capture_default_str();
  command
      ->add_option("--sampling", o->sampling,
                   "Random numbers per pixel, or common to all; a single pass (estimator none)")
      ->check(CLI::IsMember({"independent", "crn"}));
  command
      ->add_option("--groups", o->groups,
                   "Groups of samples whose means films keep; default 12, 1 for a single independent pass")
      ->check(CLI::Range(1u, 1024u));
  command->add_option("--display-server", o->display_server,
                      "HOST:PORT of a running tev, which shows the image while it renders");
  command->add_option("--until", o->until, "relmse=X: add samples until the predicted error is X, at most --spp");
  command->add_option("--seed", o->seed, "Seed of the random numbers")->capture_default_str();
  command->add_option("--resolution", o->resolution, "WIDTHxHEIGHT of the full frame; default: the scene's");
  command->add_option("--crop", o->crop, "X,Y,WIDTH,HEIGHT: render only these pixels of the frame");
  command->add_option("--min-depth", o->min_depth, "Leave out paths with fewer edges than this")
      ->check(CLI::Range(0, 1 << 30));
  command->add_option("--max-depth", o->max_depth, "Largest number of path edges; -1: no limit; default: the scene's")
      ->check(CLI::Range(-1, 1 << 30));
  command->add_option("--rfilter", o->rfilter, "Reconstruction filter instead of the scene's")
      ->check(CLI::IsMember({"box", "tent", "gaussian"}));
  command->add_option("--threads", o->threads, "Number of threads; default: all")->check(CLI::Range(1, 4096));
  command->add_option("--time", o->seconds, "Stop after this many seconds of rendering")->check(CLI::PositiveNumber);
  command->add_option("--passes,--save-passes", o->passes, "Folder that keeps the film of every pass");
  command->add_flag("--resume", o->resume, "Continue the films of an interrupted render, or those in --passes");
  command->add_option("--checkpoint", o->checkpoint_seconds, "Seconds between writing unfinished films; 0: never")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command->add_option("-D,--define", o->defines, "name=value for the scene's <default> elements")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
  command->add_flag("--aovs", o->aovs, "Add the images Albedo, N (normal) and P (position) to the output");
  command->add_option("--replay", o->replay, "X,Y,SAMPLE: print one sample instead of rendering");
  command->add_option("--json", o->json, "File for statistics; '-': standard output");
  command->add_flag("!--no-preview", o->preview, "Do not write the PNG");
  command->add_flag("--quiet", o->quiet, "No progress and no summary");
  add_estimator_options(*command, o->estimator);
  command->callback([o] { render(*o); });
}

}  // namespace covary
