// SPDX-License-Identifier: Apache-2.0
// covary denoise: denoises an image with Open Image Denoise; several renders, or a film with groups, with mixtures that
// are judged by their halves.
#include "denoising/denoise.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <utility>

#include "combine/beauty_layers.h"
#include "combine/combine.h"
#include "combine/combine_settings.h"
#include "combine/registry.h"
#include "combine/result_file.h"
#include "commands.h"
#include "core/error.h"
#include "core/memory_limit.h"
#include "core/printable.h"
#include "core/stopwatch.h"
#include "declared_options.h"
#include "denoising/mixed_denoising.h"
#include "feature_layers.h"
#include "film/denoised_by.h"
#include "film/exr_copy.h"
#include "film/image_rows.h"
#include "film/outputs.h"
#include "film/pictures.h"
#include "film/written_by.h"
#include "filters/stray_values.h"
#include "frame_files.h"
#include "json_output.h"
#include "metrics/provenance.h"
#include "network_memory.h"
#include "numbers.h"
#include "picture_options.h"
#include "progress.h"
#include "risk_report.h"
#include "sequences/frame_names.h"
#include "usage_error.h"
#include "value_names.h"
#include "watched_folders.h"

namespace covary {
namespace {

/// --mode: Open Image Denoise alone, or the objective of a mixture.
constexpr const char* kNetwork = "oidn";

struct Options {
  std::vector<std::string> inputs;
  std::string output, mode, oidn, albedo, normal, json;
  PictureChoice choice;
  std::vector<std::string> layers;
  bool no_features = false, clean_features = false, check = false, force = false, overwrite = false;
  bool quiet = false, verbose = false;
  FrameOptions of_frames;
  std::optional<double> memory_mib;
  std::shared_ptr<const History> history;  ///< of the frame being denoised
  DenoiseOptions denoiser() const { return {oidn}; }
  DenoisingChoice mixing() const {
    return {mode.empty() ? default_denoising(kDefaultEstimator) : mode, oidn, {history}};
  }
};

/// --check: prints which library is used.
void check(const Options& o) {
  const DenoiserInfo info = denoiser_info(o.denoiser());
  fmt::print("Open Image Denoise {}\n{}\n", info.version, info.path);
}

void warn_of_values(const std::string& path, const Image& image) {
  std::vector<StrayValue> replaced;
  with_usable_values(image, &replaced);
  if (replaced.empty()) return;
  fmt::print(stderr,
             "warning: {}: {} of {} pixels hold values that are NaN, infinite, overflow or outshine the whole picture "
             "{:.0f} times, the first at ({}, {}); the pixels around replace them\n",
             path, replaced.size(), image.data.size() / 3, kMaxOfPicture, replaced[0].x, replaced[0].y);
}

/// One picture of the inputs: what is denoised, and where the result goes.
struct Task {
  Picture picture;    ///< what the result replaces
  std::string layer;  ///< what is denoised: the picture, or the render before Cycles denoised it
  bool is_only = true;
  std::string text() const {
    return is_only ? "" : fmt::format(" ({})", picture.layer.empty() ? "R G B" : picture.layer);
  }
  std::string prefix() const { return is_only || picture.layer.empty() ? "" : picture.layer + "."; }
};

/// A denoised picture, and what to say about it.
struct Denoised {
  ResultPicture result;
  std::map<std::string, std::string> attributes;
  std::optional<PredictedError> predicted;
  nlohmann::ordered_json json;
  std::function<void()> report;
};

/// What is denoised: the picture of each view and view layer, if none is named.
std::vector<Task> tasks_of(const Options& o) {
  const std::vector<ExrFile::Channel> channels = inspect_image(o.inputs[0]).channels;
  std::vector<Picture> pictures = find_pictures(channels);
  if (!o.choice.layer.empty() || !o.choice.view.empty() || pictures.empty())
    pictures = is_unnamed(o.choice) ? std::vector<Picture>(1) : chosen_pictures(o.inputs[0], channels, o.choice);
  std::vector<Task> tasks;
  for (const Picture& picture : pictures) {
    const std::string noisy = picture.layer == o.choice.layer ? "" : noisy_layer(picture, channels);
    if (!noisy.empty())
      fmt::print(stderr, "note: {}: '{}' is denoised already; '{}' beside it, which is not, is denoised instead\n",
                 printable(o.inputs[0]), picture.layer, noisy);
    tasks.push_back({picture, noisy.empty() ? picture.layer : noisy, pictures.size() == 1});
  }
  return tasks;
}

std::map<std::string, std::string> new_attributes(const Options& o) {
  std::map<std::string, std::string> attributes = inherited_attributes(o.inputs);
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  return attributes;
}

/// Alpha as an image; empty if it is 0 or 1 everywhere, with nothing to denoise.
Image partial_alpha(const std::string& path, const std::string& channel) {
  Image alpha = read_image(path, channel, ChecksumPolicy::kCheck, std::nullopt).image;
  const bool partial = std::any_of(alpha.data.begin(), alpha.data.end(), [](float a) { return a > 0 && a < 1; });
  return partial ? alpha : Image();
}

Image as_alpha(const Image& grey) {
  Image alpha(grey.width, grey.height, 1);
  for (size_t i = 0; i < alpha.data.size(); ++i) alpha.data[i] = std::clamp(grey.data[3 * i], 0.0f, 1.0f);
  return alpha;
}

Denoised denoise_by_network(const Options& o, const Task& task, ProgressLine& progress) {
  const Stopwatch watch;
  const std::string& input = o.inputs[0];
  if (!DenoisingChoice{"auto", o.oidn, {}}.uses_oidn())
    usage("'" + input +
          "' is one image, which only Open Image Denoise denoises: leave out --oidn off, or give a "
          "second render of another seed, too");
  const ImageInfo info = inspect_image(input);
  require_memory_of_network(input, info.place.window, o.memory_mib);
  const ColourSpace colours = ImageRows(input, task.layer).colours();
  FeatureLayers features({o.inputs, task.picture, colours, o.albedo, o.normal, o.no_features});
  const PlacedImage image = read_image(input, task.layer, ChecksumPolicy::kCheck, std::nullopt);
  warn_of_values(input, image.image);
  if (const std::string by = denoised_by(info.attributes, info.channels, task.layer); !by.empty())
    fmt::print(stderr, "warning: {} is denoised already ({}); give the render before denoising ({})\n", input, by,
               where_to_set(RenderSetting::kNoDenoiser, written_by(info.attributes)));
  progress.begin("denoising");
  Denoiser denoiser(o.denoiser());
  const std::string guided = features.text();
  const auto taken = [&](const char* name, std::optional<Image>& feature) -> std::shared_ptr<const Image> {
    if (!feature) return nullptr;
    Image own = *std::exchange(feature, std::nullopt);
    return std::make_shared<const Image>(o.clean_features ? denoiser.denoise_feature(name, own) : std::move(own));
  };
  const std::shared_ptr<const Image> albedo = taken("albedo", features.albedo),
                                     normal = taken("normal", features.normal);
  const auto denoised = [&](const Image& noisy) { return denoiser.denoise(noisy, albedo, normal, o.clean_features); };
  Denoised result;
  const std::vector<std::string> picture = layer_channels(input, info.channels, task.picture.layer);
  result.result.image.estimate = denoised(image.image);
  result.result.source = {o.inputs, {picture[0], picture[1], picture[2]}, {}, task.prefix()};
  const std::string alpha = is_exr_image(input) ? alpha_channel(info.channels, picture[0]) : "";
  if (Image values = alpha.empty() ? Image() : partial_alpha(input, alpha); !values.data.empty())
    result.result.aovs[alpha] = as_alpha(denoised(values));
  result.attributes = new_attributes(o);
  result.attributes["covary:denoiser"] = "Open Image Denoise " + denoiser_info(o.denoiser()).version;
  result.report = [=, width = image.image.width, height = image.image.height, seconds = watch.seconds()] {
    fmt::print(stderr, "{}{}: {} x {}, {}, in {:.2f} s\n{}", o.output, task.text(), width, height, guided, seconds,
               kErrorOfOneRender);
  };
  return result;
}

nlohmann::ordered_json statistics(const Options& o, const CombineRequest& request, const CombinedImage& combined,
                                  const DenoisingChoice& choice) {
  nlohmann::ordered_json json{
      {"output", o.output},
      {"estimator", request.estimator.text},
      {"width", request.independent.width},
      {"height", request.independent.height},
      {"independent_groups", request.independent.groups},
      {"nonfinite_pixels", combined.image.nonfinite_pixels},
      {"planned_memory_bytes", combined.planned_memory},
      {"peak_memory_bytes", peak_memory_bytes()},
      {"seconds", {{"read_and_check", combined.check_seconds}, {"estimate", combined.estimate_seconds}}}};
  if (combined.predicted) add_prediction(*combined.predicted, json);
  add_risks(combined.image.risks, json);
  add_network(request.estimator.network, combined.image.network_runs, choice, json);
  if (!combined.image.note.empty()) json["note"] = combined.image.note;
  return json;
}

Denoised denoise_by_mixture(const Options& o, const Task& task, const GroupedFile& file, ProgressLine& progress) {
  CombineRequest request;
  request.independent = source_of(file);
  const DenoisingChoice choice = o.mixing();
  request.estimator = make_default_estimator(false, {}, choice);
  request.settings.std_error = true;
  const FeatureLayers features({o.inputs, task.picture, file.colours(), o.albedo, o.normal, o.no_features});
  request.settings.features = features.view();
  const BeautyLayers layers(o.inputs, task.picture, o.layers, true);
  request.layers = layers.sources();
  request.force = o.force;
  limit_memory(request, o.memory_mib);
  request.checked = [&](const InputFindings& found) {
    progress.clear();
    print_findings(found.findings, "denoises", o.force, o.quiet);
    progress.begin("denoising");
  };
  CombinedImage combined = combine(request);
  layers.finish(combined.layers);
  Denoised result;
  result.json = statistics(o, request, combined, choice);
  if (!task.is_only) result.json["picture"] = task.picture.layer;
  result.result.source = file.source();
  if (!task.picture.channels[0].empty()) result.result.source.picture = task.picture.channels;
  result.result.source.prefix = task.prefix();
  result.attributes = new_attributes(o);
  if (o.history) result.attributes[kHistoryAttribute] = o.history->of;
  result.attributes["covary:estimator"] = request.estimator.text;
  if (!request.estimator.network.empty()) result.attributes["covary:denoiser"] = request.estimator.network;
  if (file.samples() > 0) result.attributes["covary:samples"] = fmt::to_string(file.samples());
  result.predicted = combined.predicted;
  const std::string note = combined.image.note, lines = error_lines(combined, o.verbose);
  result.result.image = std::move(combined.image), result.result.aovs = std::move(combined.layers);
  const std::string what = fmt::format("{}{}: {} x {}, {} of {}, {}, in {:.2f} s", o.output, task.text(), file.width(),
                                       file.height(), request.estimator.text, file.groups_text(), features.text(),
                                       combined.check_seconds + combined.estimate_seconds);
  result.report = [what, note, lines, choice] {
    print_notes(choice, note);
    fmt::print(stderr, "{}\n{}", what, lines);
  };
  return result;
}

/// Writes the results in place of the pictures of the first input.
void write(const Options& o, const ImagePlace& place, std::vector<Denoised>& all, ProgressLine& progress) {
  progress.begin("writing");
  std::vector<ResultPicture> pictures;
  for (Denoised& one : all) pictures.push_back(std::move(one.result));
  const std::vector<std::string> lost =
      pictures.size() == 1
          ? write_result(o.output, place, all[0].attributes, pictures[0].image, pictures[0].aovs, pictures[0].source)
          : write_results(o.output, all[0].attributes, pictures);
  progress.finish();
  for (const std::string& what : lost) fmt::print(stderr, "warning: {}\n", printable(what));
  std::string json;  // an object and line for each picture
  for (const Denoised& one : all) json += json_text(one.json, all.size() == 1 ? 2 : -1);
  if (!o.json.empty()) write_text_output(o.json, json);
  for (const Denoised& one : all)
    if (!o.quiet) one.report();
}

/// Whether the options select the network alone, whatever the image.
bool is_by_network(const Options& o) { return o.mode == kNetwork || (o.mode.empty() && o.clean_features); }

void check_options(const Options& o) {
  if (o.inputs.empty() || o.output.empty()) usage("expected IN.exr and -o OUT.exr, or --check");
  if (o.no_features && !(o.albedo + o.normal).empty()) usage("--albedo and --normal have no effect with --no-features");
  if (o.no_features && o.clean_features) usage("--clean-features has no effect with --no-features");
  for (size_t i = 0; i < o.inputs.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (is_same_file(o.inputs[i], o.inputs[k]))
        usage(fmt::format("'{}' and '{}' are the same file; renders of different seeds are needed", o.inputs[k],
                          o.inputs[i]));
  if (o.inputs.size() > 1 && is_by_network(o))
    usage("--mode oidn and --clean-features are for one image; covary merge makes one of films");
  if (o.clean_features && !is_by_network(o))
    usage("--clean-features is an option of --mode oidn; mixtures always denoise their auxiliary features first");
}

/// Returns what to say about the result.
std::string run_one(const Options& o) {
  check_options(o);
  Outputs outputs;
  outputs.reads(o.inputs);
  outputs.writes_result("-o", o.output, OutputKind::kFilm, "denoise", o.overwrite);
  outputs.writes("--json", o.json, OutputKind::kText);
  ProgressLine progress(std::filesystem::path(o.inputs[0]).stem().string(), o.quiet);
  progress.begin("loading");
  ImagePlace place;
  std::vector<Denoised> all;
  for (const Task& task : tasks_of(o)) {
    std::optional<GroupedFile> file;
    if (!is_by_network(o)) file.emplace(o.inputs, task.layer);
    const bool is_mixture = file && file->groups() > 1;
    if (file && !is_mixture && !o.mode.empty())
      throw Error(ErrorCode::kUsage, fmt::format("--mode {} needs a second render of another seed, or a film with two "
                                                 "groups or more (--groups); '{}' has one",
                                                 o.mode, o.inputs[0]));
    if (!o.layers.empty() && !is_mixture)
      throw Error(ErrorCode::kUsage, "--layers are denoised by a mixture, which needs a second render of another seed");
    if (!o.json.empty() && !is_mixture)
      throw Error(ErrorCode::kUsage, "--json tells the error, which needs a second render of another seed");
    place = file ? file->place() : inspect_image(o.inputs[0]).place;
    all.push_back(is_mixture ? denoise_by_mixture(o, task, *file, progress) : denoise_by_network(o, task, progress));
  }
  write(o, place, all, progress);
  const std::optional<PredictedError>& error = all[0].predicted;
  return o.output + (o.history ? ", with the frame before" : "") +
         (error ? ", " + prediction_text(*error, std::nullopt) : "");
}

void run_sequence(const Options& o, const FramePatterns& patterns) {
  if (!o.json.empty() && o.json != "-" && !is_frame_pattern(o.json))
    throw Error(ErrorCode::kUsage, fmt::format("--json '{}': of frames, expected a name with '#', or -", o.json));
  for_each_frame(o.of_frames, patterns, !is_by_network(o), [&](int frame, std::shared_ptr<const History> history) {
    Options one = o;
    one.output = frame_name(o.output, frame);
    if (is_frame_pattern(o.json)) one.json = frame_name(o.json, frame);
    for (std::string& path : one.inputs) path = frame_name(path, frame);
    one.history = std::move(history);
    one.quiet = true;
    return run_one(one);
  });
}

void run_folders(const Options& o) {
  if (!o.json.empty() && o.json != "-")
    throw Error(ErrorCode::kUsage, fmt::format("--json '{}': for images of a folder, expected -", o.json));
  for_each_image(o.of_frames, o.inputs, o.output,
                 [&](const std::vector<std::string>& paths, const std::string& result) {
                   Options one = o;
                   one.inputs = paths, one.output = result, one.quiet = true;
                   return run_one(one);
                 });
}

void run(Options o) {
  o.of_frames.quiet = o.quiet;
  if (o.check) return check(o);
  if (are_folders(o.of_frames, o.inputs, o.output)) return run_folders(o);
  const std::string made_by = is_by_network(o) ? "" : make_default_estimator(false, {}, o.mixing()).text;
  const FramePatterns patterns{o.inputs, {}, o.output, o.choice, made_by};
  if (are_frames(o.of_frames, patterns)) return run_sequence(o, patterns);
  run_one(o);
}

}  // namespace

void add_denoise(CLI::App& app) {
  const auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("denoise", "Denoise an image, or several renders of different seeds");
  add_value(*command, "IN", o->inputs, kFileValue,
            "Linear image (EXR), guided by its albedo and normal layers, whatever the renderer calls them. Several "
            "renders that differ only in their seed, or a film with groups, give a better image and its error. With "
            "--watch also folders: files of the same name in each are renders of one picture")
      ->expected(1, 1000);
  add_value(*command, "-o,--output", o->output, kFileValue, "The result (EXR), or the folder of the results");
  add_picture_options(*command, o->choice, "Denoise", "default: all pictures of the files");
  std::vector<std::string> modes = {kNetwork};
  modes.insert(modes.end(), denoise_mode_names().begin() + 1, denoise_mode_names().end());
  command
      ->add_option("--mode", o->mode,
                   "Open Image Denoise alone, or a mixture of denoised images with little bias, balanced, or with the "
                   "least error; default: auto for several renders or groups, oidn for a single image")
      ->check(one_of(modes));
  add_value(*command, "--oidn", o->oidn, "off|LIBRARY",
            "Open Image Denoise's library or its folder, or that of the Python package pyoidn or of its "
            "environment; 'off': mixtures without it");
  command->add_flag("--check", o->check, "Only print the version and path of Open Image Denoise");
  add_value(*command, "--albedo", o->albedo, "LAYER|FILE",
            "Layer or file of the albedo; default: by the renderer's usual name");
  add_value(*command, "--normal", o->normal, "LAYER|FILE",
            "Layer or file of the normals, from -1 to 1; default: likewise");
  add_value(
      *command, "--layers", o->layers, "LAYER",
      "Layers of the inputs to denoise with the picture's weights, so that with Rest they add up to it; 'all': those "
      "of lights, and of direct and indirect light, that Blender and Arnold write")
      ->delimiter(',');
  command->add_flag("--no-features", o->no_features, "Do not use auxiliary features");
  command->add_flag(
      "--clean-features", o->clean_features,
      "With --mode oidn, denoise the auxiliary features first: less error if they are noisy, in three times the time");
  add_value(*command, "--json", o->json, kFileValue, "File for statistics of a mixture; '-': standard output");
  command->add_option("--memory", o->memory_mib, kMemoryHelp)->check(positive_number());
  add_frame_options(*command, o->of_frames, "Denoise");
  add_overwrite_option(*command, o->overwrite);
  command->add_flag("--force", o->force, "Denoise even if the renders do not match");
  command->add_flag("--verbose", o->verbose, kVerboseHelp);
  command->add_flag("--quiet", o->quiet, "No summary");
  command->callback([o] { run(*o); });
}

}  // namespace covary
