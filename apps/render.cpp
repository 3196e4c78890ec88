// SPDX-License-Identifier: Apache-2.0
// covary render: a scene to a film.
#include <fmt/format.h>
#include <sys/resource.h>
#include <tbb/global_control.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <thread>

#include "commands.h"
#include "core/error.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "film/output_file.h"
#include "integrators/aov.h"
#include "integrators/integrator.h"
#include "integrators/render_pass.h"
#include "io/load_scene.h"
#include "progress.h"

namespace covary {
namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

struct RenderOptions {
  std::string scene, output, integrator, estimator = "none", sampling = "independent", rfilter, json, save_passes;
  std::string resolution, crop, replay;
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
    case FilterKind::kBox: return fmt::format("box radius={}", filter.radius);
    case FilterKind::kTent: return fmt::format("tent radius={}", filter.radius);
    case FilterKind::kGaussian: return fmt::format("gaussian radius={} stddev={}", filter.radius, filter.stddev);
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
  return fmt::format("unknown integrator '{}'{}; supported: {}", name, did_you_mean(name, names), fmt::join(names, ", "));
}

std::shared_ptr<Integrator> make_integrator(Parameters& parameters, const RenderOptions& options) {
  PathLengthSettings lengths = PathLengthSettings::from(parameters);
  if (options.min_depth) lengths.min_depth = *options.min_depth;
  if (options.max_depth) lengths.max_depth = *options.max_depth < 0 ? PathLengthSettings::kUnlimited : *options.max_depth;
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

/// Command that repeats one sample: the user's own, with the sample in place of the outputs.
std::string replay_command(const RenderOptions& o, const BadSample& bad) {
  std::string text = "covary render " + o.scene;
  for (const std::string& define : o.defines) text += " -D " + define;
  if (!o.resolution.empty()) text += " --resolution " + o.resolution;
  if (!o.integrator.empty()) text += " --integrator " + o.integrator;
  if (o.min_depth) text += fmt::format(" --min-depth {}", *o.min_depth);
  if (o.max_depth) text += fmt::format(" --max-depth {}", *o.max_depth);
  if (!o.rfilter.empty()) text += " --rfilter " + o.rfilter;
  return text + fmt::format(" --sampling {} --seed {} --replay {},{},{}", o.sampling, o.seed, bad.x, bad.y, bad.sample);
}

void report_bad_samples(const RenderOptions& options, const PassResult& result) {
  if (result.bad_samples.empty()) return;
  fmt::print(stderr, "warning: {} samples were not finite and {} negative; they count as black. The first:\n",
             result.n_not_finite, result.n_negative);
  for (const BadSample& bad : result.bad_samples)
    fmt::print(stderr, "  pixel ({}, {}), sample {}: ({}, {}, {})\n    {}\n", bad.x, bad.y, bad.sample, bad.value.r,
               bad.value.g, bad.value.b, replay_command(options, bad));
}

nlohmann::json statistics(const RenderOptions& options, const LoadedScene& scene, const Film& film,
                          const PassResult& result, double load_seconds, double write_seconds, int threads) {
  const double rate = 1 / std::max(result.seconds, 1e-9);
  nlohmann::json bad = nlohmann::json::array();
  for (const BadSample& b : result.bad_samples)
    bad.push_back({{"x", b.x}, {"y", b.y}, {"sample", b.sample}, {"replay", replay_command(options, b)}});
  return {{"version", COVARY_VERSION},
          {"command", command_line()},
          {"scene", options.scene},
          {"scene_hash", scene.content_hash},
          {"width", film.width()},
          {"height", film.height()},
          {"samples_per_pixel", film.mean_count()},
          {"groups", film.groups()},
          {"sampling", options.sampling},
          {"seed", options.seed},
          {"threads", threads},
          {"complete", result.complete},
          {"seconds",
           {{"load", load_seconds},
            {"build", scene.scene->build_seconds()},
            {"render", result.seconds},
            {"write", write_seconds}}},
          {"samples", result.n_samples},
          {"rays", result.n_rays},
          {"samples_per_second", static_cast<double>(result.n_samples) * rate},
          {"paths_per_second", static_cast<double>(result.n_samples) * rate},
          {"rays_per_second", static_cast<double>(result.n_rays) * rate},
          {"triangles", scene.scene->n_triangles()},
          {"peak_memory_bytes", peak_memory_bytes()},
          {"not_finite_samples", result.n_not_finite},
          {"negative_samples", result.n_negative},
          {"bad_samples", bad}};
}

// ---- the film --------------------------------------------------------------------------------------------------------

/// The film to continue, or a new one.
Film open_film(const RenderOptions& options, const LoadedScene& scene, const CropWindow& crop, int groups,
               const std::map<std::string, std::string>& attributes) {
  if (!options.resume || !std::filesystem::exists(options.output)) {
    Film film(scene.width, scene.height, crop, groups);
    film.attributes = attributes;
    return film;
  }
  Film film = read_film(options.output);
  const auto differs = [&](const std::string& what, const std::string& old_value, const std::string& new_value) {
    throw Error(ErrorCode::kInput, fmt::format("--resume: '{}' was rendered with {} {}, this command asks for {}",
                                               options.output, what, old_value, new_value));
  };
  const auto size_text = [](int w, int h, const CropWindow& c) {
    return fmt::format("{} x {}, crop {},{},{},{}", w, h, c.x, c.y, c.width, c.height);
  };
  const std::string old_size = size_text(film.frame_width(), film.frame_height(), film.crop());
  const std::string new_size = size_text(scene.width, scene.height, crop);
  if (old_size != new_size) differs("frame", old_size, new_size);
  if (film.groups() != groups) differs("groups", std::to_string(film.groups()), std::to_string(groups));
  for (const char* key : {film_key::kSceneHash, film_key::kSampling, film_key::kSeed, film_key::kSettings})
    if (film.attributes[key] != attributes.at(key)) differs(key, film.attributes[key], attributes.at(key));
  film.attributes = attributes;
  return film;
}

void check_output_writable(const std::string& output) {
  const std::filesystem::path folder = std::filesystem::absolute(output).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw Error(ErrorCode::kIo, "cannot write '" + output + "': the folder '" + folder.string() + "' does not exist");
}

void replay(const RenderOptions& options, const LoadedScene& scene, const Integrator& integrator,
            const PassSettings& settings) {
  const auto at = parse_numbers("--replay", options.replay, ',', 3, "X,Y,SAMPLE, e.g. 640,360,17");
  if (at[0] >= scene.width || at[1] >= scene.height)
    throw Error(ErrorCode::kUsage,
                fmt::format("--replay '{}' is outside the {} x {} frame", options.replay, scene.width, scene.height));
  const ReplayedSample sample = replay_sample(*scene.scene, integrator, settings, static_cast<int>(at[0]),
                                              static_cast<int>(at[1]), static_cast<uint64_t>(at[2]));
  fmt::print("pixel ({}, {}), sample {}, film position ({}, {}), {} rays\nradiance ({:.9g}, {:.9g}, {:.9g})\n", at[0],
             at[1], at[2], sample.position.x, sample.position.y, sample.n_rays, sample.value.r, sample.value.g,
             sample.value.b);
}

void render(const RenderOptions& options) {
  if (options.replay.empty() && options.output.empty())
    throw Error(ErrorCode::kUsage, "no output given; use -o OUT.exr (or --replay X,Y,SAMPLE)");
  if (!options.integrator.empty() && !find_integrator(options.integrator))
    throw Error(ErrorCode::kUsage, "--integrator: " + unknown_integrator(options.integrator));
  if (!options.output.empty()) check_output_writable(options.output);
  const int threads = options.threads > 0 ? options.threads : static_cast<int>(std::thread::hardware_concurrency());
  const tbb::global_control control(tbb::global_control::max_allowed_parallelism, static_cast<size_t>(threads));

  const auto load_start = Clock::now();
  LoadedScene scene = load(options);
  const double load_seconds = seconds_since(load_start) - scene.scene->build_seconds();
  for (const std::string& warning : scene.warnings) fmt::print(stderr, "warning: {}\n", warning);
  const auto& integrator = dynamic_cast<const Integrator&>(*scene.integrator);

  PassSettings settings;
  settings.sampling = options.sampling == "crn" ? Sampling::kCrn : Sampling::kIndependent;
  settings.seed = options.seed;
  settings.filter = options.rfilter.empty() ? scene.filter : filter_named(options.rfilter);
  settings.seconds = options.seconds;
  settings.stop = &g_stop;
  if (!options.replay.empty()) return replay(options, scene, integrator, settings);

  const auto groups = static_cast<int>(options.groups.value_or(settings.sampling == Sampling::kCrn ? 12 : 1));
  const uint32_t wanted = options.spp.value_or(options.seconds > 0 ? 1u << 30 : static_cast<uint32_t>(scene.spp));
  settings.spp = (wanted + groups - 1) / groups * groups;
  if (settings.spp != wanted && options.seconds <= 0)
    fmt::print(stderr, "note: {} samples per pixel instead of {}, so that all {} groups have the same size\n",
               settings.spp, wanted, groups);

  const CropWindow crop = crop_window(options, scene);
  const std::map<std::string, std::string> attributes = {
      {film_key::kSeed, std::to_string(options.seed)},
      {film_key::kSampling, options.sampling},
      {film_key::kSceneHash, scene.content_hash},
      {film_key::kSettings, integrator.description() + "; filter " + filter_text(settings.filter)},
      {film_key::kVersion, COVARY_VERSION},
      {film_key::kCommand, command_line()},
      {film_key::kComplete, "false"},
  };
  Film film = open_film(options, scene, crop, groups, attributes);

  g_stop = false;
  std::signal(SIGINT, on_signal);
  std::signal(SIGTERM, on_signal);
  ProgressLine progress(std::filesystem::path(options.scene).stem().string(), options.quiet);
  settings.progress = [&](uint64_t done, uint64_t total) {
    progress.update(done, options.seconds > 0 && !options.spp ? 0 : total, options.seconds);
  };
  auto last_checkpoint = Clock::now();
  settings.checkpoint = [&] {
    if (options.checkpoint_seconds <= 0 || seconds_since(last_checkpoint) < options.checkpoint_seconds) return;
    write_film(options.output, film);
    last_checkpoint = Clock::now();
  };
  const PassResult result = render_pass(*scene.scene, integrator, settings, film);
  progress.finish();

  const auto write_start = Clock::now();
  if (options.aovs && !g_stop)
    render_aovs(*scene.scene, settings.filter, settings.sampling, settings.seed, settings.pass, 16, film);
  const bool done = result.complete || options.seconds > 0;
  film.attributes[film_key::kComplete] = done && !g_stop ? "true" : "false";
  write_film(options.output, film);
  if (options.preview) write_png(preview_path(options.output), film.mean_image());
  if (!options.save_passes.empty()) {
    std::filesystem::create_directories(options.save_passes);
    write_film(options.save_passes + "/pass00-" + options.sampling + ".exr", film);
  }
  const double write_seconds = seconds_since(write_start);

  report_bad_samples(options, result);
  if (!options.json.empty()) {
    const std::string text =
        statistics(options, scene, film, result, load_seconds, write_seconds, threads).dump(2) + "\n";
    if (options.json == "-") fmt::print("{}", text);
    else write_text_file(options.json, text);
  }
  if (g_stop && !result.complete)
    throw Error(ErrorCode::kIo, fmt::format("interrupted after {:.1f} of {} samples per pixel; '{}' holds what was "
                                            "rendered, the same command with --resume continues",
                                            film.mean_count(), settings.spp, options.output));
  if (!options.quiet)
    fmt::print(stderr, "{}: {} x {}, {:g} samples per pixel in {:.2f} s (load {:.2f} s, build {:.2f} s, {} samples/s, {} rays/s)\n",
               options.output, film.width(), film.height(), film.mean_count(), result.seconds, load_seconds,
               scene.scene->build_seconds(), format_count(static_cast<double>(result.n_samples) / result.seconds),
               format_count(static_cast<double>(result.n_rays) / result.seconds));
}

}  // namespace

void add_render(CLI::App& app) {
  const auto o = std::make_shared<RenderOptions>();
  CLI::App* command = app.add_subcommand("render", "Render a scene (Mitsuba XML) into a film (EXR)");
  command->add_option("SCENE", o->scene, "Scene file, Mitsuba XML")->required();
  command->add_option("-o,--output", o->output, "The film (EXR); a PNG preview appears beside it");
  command->add_option("--spp", o->spp, "Samples per pixel; default: the scene's")->check(CLI::Range(1u, 1u << 30));
  command->add_option("--integrator", o->integrator, "Integrator instead of the scene's: path");
  command->add_option("--estimator", o->estimator, "How passes become the image")->check(CLI::IsMember({"none"}));
  command->add_option("--sampling", o->sampling, "Random numbers: per pixel, or common to all pixels")
      ->check(CLI::IsMember({"independent", "crn"}));
  command->add_option("--groups", o->groups, "Groups of samples whose means the film keeps; default 12 for crn, else 1")
      ->check(CLI::Range(1u, 1024u));
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
  command->add_flag("--resume", o->resume, "Continue the film at the output path, if there is one");
  command->add_option("--checkpoint", o->checkpoint_seconds, "Seconds between writing the unfinished film; 0: never")
      ->capture_default_str()
      ->check(CLI::NonNegativeNumber);
  command->add_option("-D,--define", o->defines, "name=value for the scene's <default> elements")
      ->take_all()
      ->expected(1)
      ->allow_extra_args(false);
  command->add_flag("--aovs", o->aovs, "Add the images Albedo, N (normal) and P (position) to the film");
  command->add_option("--save-passes", o->save_passes, "Folder that receives the film of every pass");
  command->add_option("--replay", o->replay, "X,Y,SAMPLE: print one sample instead of rendering");
  command->add_option("--json", o->json, "File for statistics; '-': standard output");
  command->add_flag("!--no-preview", o->preview, "Do not write the PNG");
  command->add_flag("--quiet", o->quiet, "No progress and no summary");
  command->callback([o] { render(*o); });
}

}  // namespace covary
