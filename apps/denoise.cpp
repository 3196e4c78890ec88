// SPDX-License-Identifier: Apache-2.0
// covary denoise: denoises an image with Open Image Denoise; several renders, or a film with groups, with mixtures that
// are judged by their halves.
#include "denoising/denoise.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <optional>
#include <utility>

#include "combine/combine_settings.h"
#include "combine/registry.h"
#include "combine/result_file.h"
#include "commands.h"
#include "core/error.h"
#include "core/printable.h"
#include "declared_options.h"
#include "denoised_pictures.h"
#include "denoising/mixed_denoising.h"
#include "film/outputs.h"
#include "frame_checks.h"
#include "frame_files.h"
#include "json_output.h"
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

/// --check: prints which library is used.
void check(const DenoiseCommand& o) {
  const DenoiserInfo info = denoiser_info(o.denoiser());
  fmt::print("Open Image Denoise {}\n{}\n", info.version, info.path);
}

/// Writes the results in place of the pictures of the first input.
void write(const DenoiseCommand& o, const ImagePlace& place, std::vector<Denoised>& all, ProgressLine& progress) {
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
bool is_by_network(const DenoiseCommand& o) { return o.mode == kNetwork || (o.mode.empty() && o.clean_features); }

void check_options(const DenoiseCommand& o) {
  if (o.inputs.empty() || o.output.empty()) usage("expected IN.exr and -o OUT.exr, or --check");
  if (o.no_features && !(o.albedo + o.normal).empty()) usage("--albedo and --normal have no effect with --no-features");
  if (o.no_features && o.clean_features) usage("--clean-features has no effect with --no-features");
  for (size_t i = 0; i < o.inputs.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (is_same_file(o.inputs[i], o.inputs[k]))
        usage(fmt::format("'{}' and '{}' are the same file; renders of different seeds are needed", o.inputs[k],
                          o.inputs[i]));
  if (o.target && is_by_network(o))
    usage("--device runs mixtures of denoised images, not Open Image Denoise alone, which has devices of its own");
  if (o.clean_features && !is_by_network(o))
    usage("--clean-features is an option of --mode oidn; mixtures always denoise their auxiliary features first");
}

/// The samples; null if the network takes the image alone. The next frame's are read from then on.
std::shared_ptr<const FrameFile> frame_of(const DenoiseCommand& o, const DenoiseTask& task) {
  if (is_by_network(o)) return nullptr;
  if (!o.next_frame || !task.is_only) return std::make_shared<const FrameFile>(o.inputs, task.layer);
  std::shared_ptr<const FrameFile> frame = o.next_frame->take(o.inputs, task.layer);
  o.next_frame->begin(o.inputs_of_next, task.layer);
  return frame;
}

/// Returns what to say about the result.
std::string run_one(const DenoiseCommand& o) {
  check_options(o);
  Outputs outputs;
  outputs.reads(o.inputs);
  outputs.writes_result("-o", o.output, OutputKind::kFilm, "denoise", o.overwrite);
  outputs.writes("--json", o.json, OutputKind::kText);
  ProgressLine progress(std::filesystem::path(o.inputs[0]).stem().string(), o.quiet);
  progress.begin("loading");
  ImagePlace place;
  std::vector<Denoised> all;
  bool mixes = false;
  warn_of_unfinished(o.inputs);
  for (const DenoiseTask& task : tasks_of(o)) {
    const std::shared_ptr<const FrameFile> frame = frame_of(o, task);
    const bool is_mixture = frame && frame->file().groups() > 1;
    mixes = mixes || is_mixture;
    if (frame && !is_mixture && !o.mode.empty())
      throw Error(ErrorCode::kUsage, fmt::format("--mode {} needs a second render of another seed, or a film with two "
                                                 "groups or more (--groups); '{}' has one",
                                                 o.mode, o.inputs[0]));
    if (!o.layers.empty() && !is_mixture)
      throw Error(ErrorCode::kUsage, "--layers are denoised by a mixture, which needs a second render of another seed");
    if (!o.json.empty() && !is_mixture)
      throw Error(ErrorCode::kUsage, "--json tells the error, which needs a second render of another seed");
    if (o.target && !is_mixture)
      throw Error(ErrorCode::kUsage, "--device runs mixtures, which need a second render of another seed");
    place = frame ? frame->file().place() : inspect_image(o.inputs[0]).place;
    all.push_back(is_mixture ? denoise_by_mixture(o, task, *frame, progress) : denoise_by_network(o, task, progress));
  }
  write(o, place, all, progress);
  const std::optional<PredictedError>& error = all[0].predicted;
  return o.output +
         (!o.history ? ""
          : mixes    ? ", with the frame before"
                     : ", of one render, which takes no history") +
         (error ? ", " + prediction_text(*error, std::nullopt) : "");
}

std::vector<std::string> inputs_of(const DenoiseCommand& o, int frame) {
  std::vector<std::string> paths;
  for (const std::string& path : o.inputs) paths.push_back(frame_name(path, frame));
  return paths;
}

void run_sequence(const DenoiseCommand& o, const FramePatterns& patterns) {
  if (!o.json.empty() && o.json != "-" && !is_frame_pattern(o.json))
    throw Error(ErrorCode::kUsage, fmt::format("--json '{}': of frames, expected a name with '#', or -", o.json));
  const auto next = std::make_shared<NextFrame>();
  for_each_frame(o.of_frames, patterns, !is_by_network(o), [&](int frame, std::shared_ptr<const History> history) {
    DenoiseCommand one = o;
    one.output = frame_name(o.output, frame);
    if (is_frame_pattern(o.json)) one.json = frame_name(o.json, frame);
    one.inputs = inputs_of(o, frame);
    if (o.target && !o.of_frames.watch) one.next_frame = next, one.inputs_of_next = inputs_of(o, frame + 1);
    one.history = std::move(history);
    one.quiet = true;
    return run_one(one);
  });
}

void run_folders(const DenoiseCommand& o) {
  if (!o.json.empty() && o.json != "-")
    throw Error(ErrorCode::kUsage, fmt::format("--json '{}': for images of a folder, expected -", o.json));
  for_each_image(o.of_frames, o.inputs, o.output,
                 [&](const std::vector<std::string>& paths, const std::string& result) {
                   DenoiseCommand one = o;
                   one.inputs = paths, one.output = result, one.quiet = true;
                   return run_one(one);
                 });
}

void run(DenoiseCommand o) {
  o.of_frames.quiet = o.quiet;
  if (o.check) return check(o);
  Settings values(o.values);
  declare_device(values, o.device);
  o.target = gpu::Target::open(o.device);
  if (are_folders(o.of_frames, o.inputs, o.output)) return run_folders(o);
  const std::string made_by = is_by_network(o) ? "" : make_default_estimator(false, {}, o.mixing(), o.target).text;
  const FramePatterns patterns{o.inputs, {}, o.output, o.choice, made_by};
  if (are_frames(o.of_frames, patterns)) return run_sequence(o, patterns);
  run_one(o);
}

}  // namespace

void add_denoise(CLI::App& app) {
  const auto o = std::make_shared<DenoiseCommand>();
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
                   "Open Image Denoise alone, of the renders' mean, or a mixture of denoised images with little bias, "
                   "balanced, or with the least error; default: auto for several renders or groups, oidn for a single "
                   "image")
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
  Settings of_device;
  declare_device(of_device, o->device);
  add_options(*command, of_device.options(), o->values);
  command->add_option("--memory", o->memory_mib, kMemoryHelp)->check(positive_number());
  add_frame_options(*command, o->of_frames, "Denoise");
  add_overwrite_option(*command, o->overwrite);
  command->add_flag("--force", o->force, "Denoise even if the renders do not match");
  command->add_flag("--verbose", o->verbose, kVerboseHelp);
  command->add_flag("--quiet", o->quiet, "No summary");
  command->callback([o] { run(*o); });
}

}  // namespace covary
