// SPDX-License-Identifier: Apache-2.0
// covary combine: image-space control variates for images of any renderer.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <tbb/global_control.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "combine/beauty_layers.h"
#include "combine/combine.h"
#include "combine/combine_settings.h"
#include "combine/pair_input.h"
#include "combine/registry.h"
#include "combine/result_file.h"
#include "commands.h"
#include "core/error.h"
#include "core/memory_limit.h"
#include "core/stopwatch.h"
#include "declared_options.h"
#include "dependent_tests/dependent_tests.h"
#include "estimators/mean.h"
#include "feature_layers.h"
#include "film/film_file.h"
#include "film/outputs.h"
#include "frame_files.h"
#include "gpu/target.h"
#include "json_output.h"
#include "method_options.h"
#include "metrics/provenance.h"
#include "numbers.h"
#include "picture_options.h"
#include "progress.h"
#include "risk_report.h"
#include "sequences/frame_names.h"
#include "stages.h"
#include "usage_error.h"
#include "value_names.h"

namespace covary {
namespace {

struct CombineOptions : CombineSettings {
  OptionValues values, of_estimator;
  FrameOptions of_frames;
  std::string stages, json, view;
  bool quiet = false, verbose = false, overwrite = false;
  int threads = 0;
  MethodTarget target;  ///< of `device`
};

Method estimator_of(const CombineOptions& o) {
  if (o.estimator == kDefaultEstimator)
    return make_default_estimator(!o.crn.empty(), o.of_estimator, o.denoising, o.target);
  return with_denoising(make_estimator(o.estimator, o.of_estimator, o.target), o.denoising, o.target);
}

std::vector<std::string> write(const CombineOptions& o, const CombineRequest& request, const ResultSource& source,
                               CombinedImage& combined) {
  std::map<std::string, std::string> attributes = inherited_attributes(o.independent);
  for (const char* of_pass : {"covary:sampling", "covary:samples", "covary:device"}) attributes.erase(of_pass);
  attributes["covary:estimator"] = estimator_of(o).text;
  if (o.target && !o.target->made_by().empty()) attributes["covary:device"] = o.target->made_by();
  if (o.denoising.history.before) attributes[kHistoryAttribute] = o.denoising.history.before->of;
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  const double crn = request.crn ? request.crn->samples : 0, independent = request.independent.samples;
  if ((crn > 0 || !request.crn) && independent > 0) attributes["covary:samples"] = fmt::to_string(crn + independent);
  if (!o.error) combined.image.std_error = {}, combined.image.bias = {};  // were needed for --json only
  return write_result(o.output, request.independent.origin.place, attributes, combined.image, combined.layers, source);
}

void check_explain(const CombineOptions& o, const Method& estimator, const GroupedFile& file) {
  if (!o.explain) return;
  const CropWindow& window = file.place().window;
  const int x = o.explain->x - window.x, y = o.explain->y - window.y;
  if (estimator.reads_features)
    throw Error(ErrorCode::kUsage,
                "--explain: a pixel that is denoised is not a sum of control variates; see --estimator " +
                    std::string(kDefaultOfPairs));
  if (!estimator.pair()->explain)
    throw Error(ErrorCode::kUsage, "--explain: " + o.estimator + " has no control variates with coefficients");
  if (x < 0 || y < 0 || x >= window.width || y >= window.height)
    throw Error(ErrorCode::kUsage,
                fmt::format("--explain {},{} is outside the image: {} x {} pixels at ({}, {})", o.explain->x,
                            o.explain->y, window.width, window.height, window.x, window.y));
}

/// The terms of one pixel's estimate: f, and for each control variate its pixel, coefficients, CRN mean and independent
/// mean.
nlohmann::ordered_json explain(const CombineOptions& o, const CombineRequest& request) {
  const CropWindow& window = request.independent.origin.place.window;
  const int x = o.explain->x - window.x, y = o.explain->y - window.y;
  const auto [g, h, first] = band_around(request, y, y + 1);
  const auto mean = [&](const GroupedImage& image, int px, int py) {
    const uint32_t count = image.count(px, py);
    return mean_of_groups({1, 1, image.groups, image.pixel(px, py), &count}).estimate.data;
  };
  nlohmann::ordered_json variates = nlohmann::ordered_json::array();
  for (const ControlVariate& v : request.estimator.pair()->explain(g, h, x, y - first))
    variates.push_back({{"dx", v.dx},
                        {"dy", v.dy},
                        {"beta", v.beta},
                        {"crn", mean(g, x + v.dx, y - first + v.dy)},
                        {"independent", mean(h, x + v.dx, y - first + v.dy)}});
  return {{"x", o.explain->x},
          {"y", o.explain->y},
          {"crn", mean(g, x, y - first)},
          {"independent", mean(h, x, y - first)},
          {"control_variates", variates}};
}

void print_explanation(const nlohmann::ordered_json& pixel) {
  const auto rgb = [](const nlohmann::ordered_json& v) {
    return fmt::format("{:9.5f} {:9.5f} {:9.5f}", v[0].get<double>(), v[1].get<double>(), v[2].get<double>());
  };
  fmt::print("pixel ({}, {}): CRN {}, independent {}\n  dx  dy  {:>29}  {:>29}  {:>29}\n", pixel["x"].get<int>(),
             pixel["y"].get<int>(), rgb(pixel["crn"]), rgb(pixel["independent"]), "coefficients", "CRN", "independent");
  for (const auto& v : pixel["control_variates"])
    fmt::print("{:4d}{:4d}  {}  {}  {}\n", v["dx"].get<int>(), v["dy"].get<int>(), rgb(v["beta"]), rgb(v["crn"]),
               rgb(v["independent"]));
}

nlohmann::ordered_json json_of(const Correlation& c) {
  if (c.pairs == 0) return nullptr;
  return {{"value", c.value}, {"standard_error", c.standard_error}, {"pairs", c.pairs}};
}

FeatureImages features_of(const CombineOptions& o, const Method& estimator, const GroupedFile& file) {
  if (o.features.empty()) return {};
  if (!estimator.reads_features)
    throw Error(ErrorCode::kUsage,
                "--features is an option of --denoise auto, bias, balanced and error, not of " + estimator.name);
  return read_features(o.features, file.place(), file.colours());
}

/// Throws Error(kUsage) if a file is used twice: it would be its own control variate, or add no information.
void check_distinct(const CombineOptions& o) {
  std::vector<std::pair<const char*, std::string>> files;
  for (const std::string& path : o.crn) files.emplace_back("--crn", path);
  for (const std::string& path : o.independent) files.emplace_back("--independent", path);
  if (!o.light.empty()) files.emplace_back("--light", o.light);
  if (!o.counts.empty()) files.emplace_back("--counts", o.counts);
  for (size_t i = 0; i < files.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (is_same_file(files[i].second, files[k].second))
        throw Error(ErrorCode::kUsage,
                    fmt::format("{} '{}' and {} '{}' are the same file; each image, or group of one, is needed once",
                                files[k].first, files[k].second, files[i].first, files[i].second));
}

void check_files_of_command(const CombineOptions& o) {
  check_distinct(o);
  Outputs outputs;
  outputs.reads(o.crn);
  outputs.reads(o.independent);
  for (const std::string& path : {o.light, o.counts, o.features})
    if (!path.empty()) outputs.reads(path);
  outputs.writes_result("-o", o.output, OutputKind::kFilm, "combine", o.overwrite);
  outputs.writes("--json", o.json, OutputKind::kText);
}

/// Reads the independent image's sample counts from the file `path`; does nothing if it is empty. All pixels of the CRN
/// image (may be null) have `crn_samples`, or the mean count in its files. Throws Error(kUsage) if neither is known,
/// and like GroupedFile::take_counts().
void take_counts(const std::string& path, std::optional<int> crn_samples, GroupedFile* crn, GroupedFile& independent) {
  if (path.empty()) return;
  independent.take_counts(path);
  if (!crn || crn->has_counts()) return;
  const auto samples = crn_samples ? static_cast<uint32_t>(*crn_samples) : std::lround(crn->samples());
  if (samples == 0)
    throw Error(ErrorCode::kUsage, "--counts needs --samples N, the samples per pixel of the CRN image");
  crn->take_count(static_cast<uint32_t>(samples));
}

/// The inputs of the command and the files they come from.
struct Inputs {
  std::optional<GroupedFile> crn;
  GroupedFile independent;
  std::optional<GroupedFile> light;
  std::optional<BeautyLayers> layers;
  FeatureImages features;
  CombineRequest request;

  explicit Inputs(const CombineOptions& o)
      : independent(o.independent, layer_of_view(o.independent[0], o.independent_layer, o.view),
                    "--independent-layer") {
    if (!o.crn.empty()) crn.emplace(o.crn, layer_of_view(o.crn[0], o.crn_layer, o.view), "--crn-layer");
    if (!o.light.empty()) light.emplace(std::vector{o.light});
    request.estimator = estimator_of(o);
    request.settings = pair_settings(
        request.estimator, needs_sample_count(request.estimator) || o.counts.empty() ? o.samples : std::nullopt,
        crn ? crn->samples() : 0, o.error || (!o.json.empty() && request.estimator.predicts_error));
    features = features_of(o, request.estimator, independent);
    request.settings.features = features.view();
    check_explain(o, request.estimator, independent);
    check_stages(o.stages, request.estimator);
    take_counts(o.counts, o.samples, crn ? &*crn : nullptr, independent);
    if (crn) request.crn = source_of(*crn);
    request.independent = source_of(independent);
    if (light) request.light = source_of(*light);
    if (const bool splits = request.estimator.splits_layers(); splits || !o.layers.empty())
      request.layers =
          layers.emplace(o.independent, Picture{"", o.view, independent.source().picture}, o.layers, splits).sources();
    limit_memory(request, o.memory_mib);
    request.force = o.force;
  }
  Inputs(const Inputs&) = delete;
  Inputs& operator=(const Inputs&) = delete;
};

nlohmann::ordered_json statistics(const CombineOptions& o, const CombineRequest& request, const CombinedImage& combined,
                                  double write_seconds) {
  const InputReport& report = combined.inputs.report;
  nlohmann::ordered_json json = {{"output", o.output},
                                 {"estimator", request.estimator.text},
                                 {"width", request.independent.width},
                                 {"height", request.independent.height},
                                 {"crn_groups", request.crn ? request.crn->groups : 0},
                                 {"independent_groups", request.independent.groups},
                                 {"nonfinite_pixels", combined.image.nonfinite_pixels},
                                 {"negative_pixels", count_negative_pixels(combined.image.estimate)},
                                 {"rank_correlation",
                                  {{"crn_horizontal", json_of(report.crn_horizontal)},
                                   {"crn_vertical", json_of(report.crn_vertical)},
                                   {"independent_horizontal", json_of(report.independent_horizontal)},
                                   {"independent_vertical", json_of(report.independent_vertical)},
                                   {"crn_independent", json_of(report.crn_independent)}}},
                                 {"mean", {{"crn", report.crn_mean}, {"independent", report.independent_mean}}},
                                 {"planned_memory_bytes", combined.planned_memory},
                                 {"peak_memory_bytes", peak_memory_bytes()},
                                 {"seconds",
                                  {{"read_and_check", combined.check_seconds},
                                   {"estimate", combined.estimate_seconds},
                                   {"write", write_seconds}}}};
  if (combined.predicted) {
    add_prediction(*combined.predicted, json);
    json["independent_predicted_relmse"] =
        predicted_relmse_of_mean(request.independent, std::max(1, rows_in_memory(request)));
  }
  if (o.target) json["device"] = o.target->made_by().empty() ? gpu::kProcessor : o.target->made_by();
  if (request.light) json["light_groups"] = request.light->groups;
  add_risks(combined.image.risks, json);
  add_error_sums(combined.image.risk_sums, json);
  add_network(request.estimator.network, combined.image.network_runs, o.denoising, json);
  if (!combined.image.note.empty()) json["note"] = combined.image.note;
  return json;
}

void write_stages(const CombineOptions& o, const CombineRequest& request) {
  if (o.stages.empty()) return;
  save_stages(o.stages, request.estimator,
              {request.crn ? request.crn->all() : GroupedImage{}, request.independent.all()}, request.settings,
              request.independent.origin.place);
}

/// Without a CRN image, the only use is to denoise the independent image's mean. Throws Error(kUsage) otherwise.
void check_passes(const CombineOptions& o) {
  if (!o.crn.empty()) return;
  if (o.estimator != kDefaultEstimator)
    usage(fmt::format("--estimator {} needs the image with common random numbers, --crn", o.estimator));
  if (!o.denoising.denoises())
    usage("without --crn, independent images can only be denoised (their mean is made by covary merge)");
  for (const char* option : {"crn-layer", "samples", "explain"})
    if (o.values.contains(option)) usage(fmt::format("--{} needs the image with common random numbers, --crn", option));
}

void combine_files(const CombineOptions& o) {
  check_files_of_command(o);
  std::optional<tbb::global_control> control;
  if (o.threads > 0) control.emplace(tbb::global_control::max_allowed_parallelism, o.threads);
  ProgressLine progress(std::filesystem::path(o.output).stem().string(), o.quiet);
  progress.begin("loading and checking");
  Inputs inputs(o);
  CombineRequest& request = inputs.request;
  request.checked = [&](const InputFindings& found) {
    progress.clear();
    print_findings(found.findings, "combines", o.force, o.quiet);
    progress.begin(o.denoising.denoises() ? "estimating and denoising" : "estimating");
  };
  CombinedImage combined = combine(request);
  if (inputs.layers) inputs.layers->finish(combined.layers);
  const std::string lines = error_lines(combined, o.verbose);
  Stopwatch watch;
  progress.begin("writing");
  const std::vector<std::string> lost = write(o, request, inputs.independent.source(), combined);
  write_stages(o, request);
  const double write_seconds = watch.lap();
  progress.finish();
  for (const std::string& what : lost) fmt::print(stderr, "warning: {}\n", what);

  nlohmann::ordered_json json = statistics(o, request, combined, write_seconds);
  if (o.explain) {
    json["pixel"] = explain(o, request);
    if (o.json != "-") print_explanation(json["pixel"]);
  }
  if (!o.quiet)
    fmt::print(stderr, "{}: {} x {}, {} of {}{} groups in {:.2f} s (read and check {:.2f} s, write {:.2f} s)\n",
               o.output, request.independent.width, request.independent.height, request.estimator.text,
               request.crn ? fmt::format("{} + ", request.crn->groups) : "", request.independent.groups,
               combined.estimate_seconds, combined.check_seconds, write_seconds);
  if (!o.quiet) {
    print_notes(o.denoising, combined.image.note);
    fmt::print(stderr, "{}", lines);
  }
  if (!o.json.empty()) write_text_output(o.json, json_text(json));
}

/// The options of a single frame.
CombineOptions frame_options(const CombineOptions& o, int frame) {
  CombineOptions one = o;
  for (std::vector<std::string>* files : {&one.crn, &one.independent})
    for (std::string& path : *files) path = frame_name(path, frame);
  for (std::string* path : {&one.light, &one.counts, &one.features}) *path = file_of_frame(*path, frame);
  one.output = frame_name(one.output, frame);
  if (is_frame_pattern(one.json)) one.json = frame_name(one.json, frame);
  return one;
}

void combine_frames(const CombineOptions& o, const FramePatterns& patterns) {
  if (!o.stages.empty()) throw Error(ErrorCode::kUsage, "--save-stages is an option of single images, not of frames");
  if (!o.json.empty() && o.json != "-" && !is_frame_pattern(o.json))
    throw Error(ErrorCode::kUsage, fmt::format("--json '{}': of frames, expected a name with '#', or -", o.json));
  for_each_frame(o.of_frames, patterns, o.denoising.denoises(), [&](int frame, std::shared_ptr<const History> history) {
    CombineOptions one = frame_options(o, frame);
    one.denoising.history.before = std::move(history);
    one.quiet = true;
    combine_files(one);
    return one.output;
  });
}

void run(CombineOptions o) {
  static_cast<CombineSettings&>(o) = settings_from<CombineSettings>(o.values);
  if (o.estimator == kDefaultEstimator && !o.of_estimator.empty()) {  // whose options they are
    o.estimator = kDefaultOfPairs;
    if (!o.values.contains("denoise")) o.denoising.mode = default_denoising(o.estimator);
  }
  check_passes(o);
  o.target = gpu::Target::open(o.device);
  FramePatterns patterns{
      o.independent, {o.features, o.light}, o.output, {o.independent_layer, o.view}, estimator_of(o).text};
  o.of_frames.quiet = o.quiet;
  patterns.images.insert(patterns.images.end(), o.crn.begin(), o.crn.end());
  are_frames(o.of_frames, patterns) ? combine_frames(o, patterns) : combine_files(o);
}

}  // namespace

void add_combine(CLI::App& app) {
  const auto o = std::make_shared<CombineOptions>();
  CLI::App* command =
      app.add_subcommand("combine", "Combine a CRN and an independent image of any renderer into one with less noise");
  add_options(*command, options_of<CombineSettings>(), o->values);
  command->get_option("--independent")->required();
  command->get_option("--output")->required();
  command->get_option("--estimator")
      ->transform(CLI::Validator([](std::string& name) { return needs_samples_text(name); }, ""));
  std::vector<Option> of_estimator = options_of_estimators(pair_estimator_names());
  std::erase_if(of_estimator, [](const Option& option) { return is_adaptive_option(option.name); });
  add_method_options(*command, {{of_estimator, &o->of_estimator}});
  add_value(*command, "--view", o->view, "NAME", "View (eye) of stereo files");
  add_stages_option(*command, o->stages);
  add_threads_option(*command, o->threads);
  add_overwrite_option(*command, o->overwrite);
  add_value(*command, "--json", o->json, kFileValue, "File for statistics; '-': standard output");
  command->add_flag("--verbose", o->verbose, kVerboseHelp);
  command->add_flag("--quiet", o->quiet, "Warnings and errors only");
  add_frame_options(*command, o->of_frames, "With --denoise, combine");
  command->callback([o] { run(*o); });
}

}  // namespace covary
