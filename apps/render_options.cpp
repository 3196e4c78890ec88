// SPDX-License-Identifier: Apache-2.0
#include "render_options.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <limits>

#include "command_description.h"
#include "commands.h"
#include "core/error.h"
#include "declared_options.h"
#include "defines.h"
#include "integrators/light_pass.h"
#include "numbers.h"
#include "plans/estimator_plans.h"
#include "plans/integrator_choice.h"
#include "plans/request_options.h"
#include "stages.h"
#include "value_names.h"

namespace covary {

std::array<double, 2> parse_split(const std::string& text) {
  const auto parts = parse_numbers("--split", text, ':', 2, "CRN:INDEPENDENT in whole numbers, e.g. 1:1");
  if (parts[0] < 1 || parts[1] < 1 || parts[0] > 1000 || parts[1] > 1000)
    throw Error(ErrorCode::kUsage, "--split '" + text + "': each part must be 1 to 1000");
  const double sum = static_cast<double>(parts[0] + parts[1]);
  return {static_cast<double>(parts[0]) / sum, static_cast<double>(parts[1]) / sum};
}

Until parse_until(const std::string& text) {
  for (const std::string key : {"relmse=", "relmse-p95="})
    if (text.starts_with(key)) {
      const std::optional<double> value = parse_real(std::string_view(text).substr(key.size()));
      if (value && *value > 0) return {*value, key != "relmse="};
    }
  throw Error(ErrorCode::kUsage,
              "--until '" + text + "': expected relmse=X or relmse-p95=X with X > 0, e.g. relmse=0.005");
}

void check_options(RenderOptions& options) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  if (!options.is_replay() && options.output.empty()) usage("no output given; use -o OUT.exr (or --replay X,Y,SAMPLE)");
  if (!options.replay.empty() && options.replay_light) usage("--replay and --replay-light exclude each other");
  if (!options.integrator.empty() && !find_integrator(options.integrator))
    usage("--integrator: " + unknown_integrator(options.integrator));
  const std::string& name = options.estimator.name;
  const auto given = [&](const char* option) { return options.estimator.command->count(option) > 0; };
  if (given("--sampling") && !given("--estimator")) options.estimator.name = kNoEstimator;
  const Estimator estimator = make_estimator(options.estimator);
  const EstimatorPasses passes = estimator.passes;
  if (given("--sampling") && passes != EstimatorPasses::kAny)
    usage(fmt::format("--sampling is an option of --estimator {}; {} renders one pass {}", kNoEstimator, name,
                      passes == EstimatorPasses::kSamples
                          ? "with independent random numbers"
                          : "with common random numbers and one with independent ones"));
  check_stages(options.stages, estimator);
  if (estimator.adaptive && given("--split"))
    usage(fmt::format("--split: the first pass of {} has its own number of samples, --dependent-spp", name));
  if (estimator.adaptive && given("--sampling"))
    usage("--sampling: --adaptive always takes independent random numbers");
  if (passes != EstimatorPasses::kPair && options.sampling != "crn" && given("--crn-part"))
    usage("--crn-part needs a pass with common random numbers");
  if (passes != EstimatorPasses::kPair && given("--split"))
    usage("--split is an option of estimators with two passes, not of " + name);
  if (passes == EstimatorPasses::kSamples && given("--groups"))
    usage(fmt::format("--groups: {} are fitted to the samples of a pixel themselves, not to means of groups", name));
  if (passes == EstimatorPasses::kSamples && given("--time"))
    usage(fmt::format(
        "--time: {} are fitted to all samples of a pixel together, so their number must be known; use --spp", name));
  parse_split(options.split);
  if (!options.until.empty()) {
    parse_until(options.until);
    if (!estimator.predicts_error)
      usage("--until: " + name + " does not estimate its error" + (estimator.adaptive ? "; see --relative-error" : ""));
    if (passes == EstimatorPasses::kAny && options.groups.value_or(2) < 2) usage("--until needs --groups 2 or more");
  }
}

namespace {

/// Options of the render that some integrators have no part in.
void check_integrator(const RenderOptions& options, const LoadedScene& scene) {
  const std::string& name = options.integrator.empty() ? scene.integrator_type : options.integrator;
  if (options.replay_light && !integrator_of(scene).light_tracing())
    throw Error(ErrorCode::kUsage,
                fmt::format("--replay-light is an option of integrators that trace light; '{}' does not", name));
  const auto* tracer = integrator_of(scene).light_tracing();
  const bool beside_crn = make_plan(options).has_crn_pass;
  if (tracer && options.of_integrator.contains("light-paths") && !tracer->wants_light_pass(beside_crn))
    throw Error(ErrorCode::kUsage,
                fmt::format("--light-paths has no effect {}",
                            beside_crn ? "beside a pass with common random numbers: no light is traced there without "
                                         "--light-tracing on"
                                       : "without light tracing (--light-tracing on)"));
  if (options.path_lengths && !integrator_of(scene).longest_path())
    throw Error(ErrorCode::kUsage,
                fmt::format("--path-lengths is an option of --integrator controlled-path, not of {}", name));
}

}  // namespace

LoadedScene load(const RenderOptions& options) {
  LoadOptions load_options;
  load_options.defines = parse_defines(options.defines);
  if (!options.resolution.empty()) {
    const auto size = parse_numbers("--resolution", options.resolution, 'x', 2, "WIDTHxHEIGHT, e.g. 1280x720");
    if (size[0] < 1 || size[1] < 1 || size[0] > 65536 || size[1] > 65536)
      throw Error(ErrorCode::kUsage, "--resolution '" + options.resolution + "': each side must be 1 to 65536");
    load_options.width = static_cast<int>(size[0]), load_options.height = static_cast<int>(size[1]);
  }
  load_options.make_integrator = integrator_maker({options.integrator, options.of_integrator});
  LoadedScene scene = load_scene(options.scene, load_options);
  check_integrator(options, scene);
  for (std::string& warning : integrator_of(scene).blind_spots(*scene.scene))
    scene.warnings.push_back(std::move(warning));
  return scene;
}

Plan make_plan(const RenderOptions& options) {
  PassChoice choice;
  choice.sampling = options.sampling == "crn" ? Sampling::kCrn : Sampling::kIndependent;
  choice.groups = options.groups;
  if (options.estimator.command->count("--split")) choice.split = parse_split(options.split);
  return estimator_plan(make_estimator(options.estimator), choice);
}

RenderRequest make_request(const RenderOptions& options, const LoadedScene& scene) {
  RenderRequest request;
  request.seed = options.seed;
  if (!options.rfilter.empty()) request.filter = filter_named(options.rfilter);
  if (!options.crop.empty()) {
    const auto c = parse_numbers("--crop", options.crop, ',', 4, "X,Y,WIDTH,HEIGHT in pixels, e.g. 240,560,240,160");
    if (c[2] < 1 || c[3] < 1 || c[0] + c[2] > scene.width || c[1] + c[3] > scene.height)
      throw Error(ErrorCode::kUsage, fmt::format("--crop '{}' does not fit into the {} x {} frame", options.crop,
                                                 scene.width, scene.height));
    request.crop = {static_cast<int>(c[0]), static_cast<int>(c[1]), static_cast<int>(c[2]), static_cast<int>(c[3])};
  }
  request.spp = options.spp;
  request.seconds = options.seconds;
  if (!options.until.empty()) {
    const Until until = parse_until(options.until);
    request.until = until.error, request.until_in_blocks = until.in_blocks;
  }
  if (options.replay.empty() && options.load_training.empty()) take_training(scene, request);
  request.aovs = options.aovs;
  request.path_lengths = options.path_lengths;
  request.crn_part = crn_part_named(options.crn_part);
  if (!options.sampler.empty()) request.sampler = sampler_named(options.sampler);
  request.output = options.output;
  request.preview = options.preview;
  request.save_training = options.save_training, request.load_training = options.load_training;
  request.passes = options.passes;
  request.resume = options.resume;
  request.overwrite = options.overwrite;
  request.checkpoint_seconds = options.checkpoint_seconds;
  request.attributes = {{film_key::kVersion, COVARY_VERSION}, {film_key::kCommand, command_line()}};
  return request;
}

SampleAddress replayed_sample(const RenderOptions& options) {
  const bool with_pass = std::count(options.replay.begin(), options.replay.end(), ',') == 3;
  const auto at = parse_numbers("--replay", options.replay, ',', with_pass ? 4 : 3,
                                "X,Y,SAMPLE, e.g. 640,360,17, or X,Y,SAMPLE,PASS");
  if (std::max(at[0], at[1]) > std::numeric_limits<int>::max() ||
      (with_pass && at[3] > std::numeric_limits<uint32_t>::max()))
    throw Error(ErrorCode::kUsage, fmt::format("--replay '{}': a number is too large", options.replay));
  SampleAddress address;
  address.sampling = options.sampling == "crn" ? Sampling::kCrn : Sampling::kIndependent;
  address.x = static_cast<int>(at[0]), address.y = static_cast<int>(at[1]);
  address.sample = static_cast<uint64_t>(at[2]);
  if (with_pass) address.pass = static_cast<uint32_t>(at[3]);
  address.groups = options.groups;
  return address;
}

namespace {

/// What a person needs who wants a picture: no heading of its own, so that `covary render --help` shows it.
CLI::Option* add_basic_options(CLI::App& command, RenderOptions& o) {
  command.add_option("SCENE", o.scene, "Scene file, Mitsuba XML")->required();
  command.add_option("-o,--output", o.output, "The image (EXR); a PNG preview appears beside it")
      ->type_name(kFileValue);
  command.add_option("--spp", o.spp, "Samples per pixel of all passes together; default: the scene's")
      ->transform(whole_number(1u, 1u << 30));
  command
      .add_option("--until", o.until,
                  "relmse=X: add samples until the predicted error is X, at most --spp; relmse-p95=X: until 95 % of "
                  "the blocks of 16 x 16 pixels have no more")
      ->type_name("relmse=X");
  command.add_option("--time", o.seconds, "Seconds for rendering and estimating, not for loading or writing")
      ->check(positive_number());
  command.add_option("--integrator", o.integrator, "Integrator instead of the scene's")
      ->type_name(fmt::format("{{{}}}", fmt::join(integrator_names(), ",")));
  command.add_option("--estimator", o.estimator.name, "How samples become the image; none: the mean of one pass")
      ->check(one_of(estimator_names()))
      ->capture_default_str();
  add_denoise_option(command, o.estimator);
  command.add_option("--seed", o.seed, "Seed of the random numbers")
      ->transform(whole_number(uint64_t{0}, std::numeric_limits<uint64_t>::max()))
      ->capture_default_str();
  command.add_option("--resolution", o.resolution, "Size of the full frame; default: the scene's")
      ->type_name("WIDTHxHEIGHT");
  command.add_option("--crop", o.crop, "Render only these pixels of the frame")->type_name("X,Y,WIDTH,HEIGHT");
  command.add_option("--passes,--save-passes", o.passes, "Keep the film of every pass here")->type_name(kFolderValue);
  CLI::Option* resume =
      command.add_flag("--resume", o.resume, "Continue the films of an interrupted render, or those in --passes");
  add_define_option(command, o.defines);
  add_threads_option(command, o.threads);
  command.add_option("--json", o.json, "Statistics; '-': to standard output")->type_name(kFileValue);
  command.add_flag("--quiet", o.quiet, "No progress and no summary");
  return resume;
}

void add_sampling_options(CLI::App& command, RenderOptions& o) {
  command.option_defaults()->group("Sampling");
  command
      .add_option("--sampler", o.sampler,
                  "Random numbers of the samples of a group: independent, or Owen-scrambled Sobol' points; default: "
                  "the scene's, any but independent meaning sobol")
      ->check(one_of({"independent", "sobol"}));
  command
      .add_option("--sampling", o.sampling,
                  "Random numbers per pixel, or common to all; a single pass (estimator none)")
      ->check(one_of({"independent", "crn"}));
  command.add_option("--split", o.split, "Parts of the samples for the two passes")
      ->type_name("CRN:INDEPENDENT")
      ->capture_default_str();
  command
      .add_option("--groups", o.groups,
                  "Groups of samples whose means films keep; default: the largest from 12 to 8 that divides the "
                  "samples, else 12, or as many as samples; 1 for a single independent pass")
      ->transform(whole_number(1, Film::kMaxGroups));
  command
      .add_option("--crn-part", o.crn_part,
                  "Which part of a path has the common random numbers, for integrators that trace light")
      ->check(one_of({"both", "camera", "light"}))
      ->capture_default_str();
  command.add_option("--rfilter", o.rfilter, "Reconstruction filter instead of the scene's")
      ->check(one_of({"box", "tent", "gaussian"}));
}

void add_output_options(CLI::App& command, RenderOptions& o, CLI::Option* resume) {
  command.option_defaults()->group("Output");
  command
      .add_flag("--overwrite", o.overwrite,
                "Replace films that are there already, in --passes or of an interrupted render")
      ->excludes(resume);
  command.add_option("--checkpoint", o.checkpoint_seconds, "Seconds between writing unfinished films; 0: never")
      ->capture_default_str()
      ->check(real_number(0, std::numeric_limits<double>::infinity()));
  command.add_flag("!--no-preview", o.preview, "Do not write the PNG");
  command.add_option("--display-server", o.display_server, "A running tev, which shows the image while it renders")
      ->type_name(kServerValue);
  command.add_flag("--aovs", o.aovs, "Add the images Albedo, N (normal) and P (position) to the output");
  command.add_flag("--path-lengths", o.path_lengths,
                   "Add an image for each number of edges of paths (Edges01, …) to the output");
  add_stages_option(command, o.stages);
  command
      .add_option("--debug-strategies", o.debug_strategies,
                  "New folder for images of each technique (s, t) of bidirectional path tracing, rendered beside")
      ->type_name(kFolderValue);
  command.add_option("--replay", o.replay, "Print one sample instead of rendering")->type_name("X,Y,SAMPLE[,PASS]");
  command.add_option("--replay-light", o.replay_light, "Print what one light path adds to the image")
      ->transform(whole_number(uint64_t{0}, (uint64_t{1} << 40) - 1))
      ->type_name("NUMBER");
}

void add_training_options(CLI::App& command, RenderOptions& o) {
  command.option_defaults()->group("Training of controlled-path and guided-path");
  command.add_option("--save-training", o.save_training, "Keep here what was learnt")->type_name(kFileValue);
  command.add_option("--load-training", o.load_training, "Such a file, to use in place of a training")
      ->type_name(kFileValue);
}

}  // namespace

void add_render_options(CLI::App& command, RenderOptions& o) {
  CLI::Option* resume = add_basic_options(command, o);
  add_sampling_options(command, o);
  add_output_options(command, o, resume);
  add_options(command, options_of_integrators(), o.of_integrator);
  add_training_options(command, o);
  command.option_defaults()->group("Denoising");
  add_oidn_option(command, o.estimator);
  command.option_defaults()->group(kBasicOptions);
  add_estimator_options(command, o.estimator, estimator_names());
}

}  // namespace covary
