// SPDX-License-Identifier: Apache-2.0
// covary denoise: denoises an image with Open Image Denoise; several renders, or a film with groups, with mixtures that
// are judged by their halves.
#include "denoising/denoise.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <memory>
#include <optional>

#include "combine/combine.h"
#include "combine/registry.h"
#include "combine/result_file.h"
#include "commands.h"
#include "core/error.h"
#include "core/stopwatch.h"
#include "declared_options.h"
#include "denoising/mixed_denoising.h"
#include "film/denoised_by.h"
#include "film/image_rows.h"
#include "film/outputs.h"
#include "filters/stray_values.h"
#include "frame_files.h"
#include "guide_layer.h"
#include "json_output.h"
#include "metrics/provenance.h"
#include "numbers.h"
#include "progress.h"
#include "risk_report.h"
#include "sequences/frame_names.h"
#include "value_names.h"

namespace covary {
namespace {

/// --mode: Open Image Denoise alone, or the objective of a mixture.
constexpr const char* kNetwork = "oidn";

struct Options {
  std::vector<std::string> inputs;
  std::string output, layer, mode, oidn, albedo, normal, json;
  std::vector<std::string> layers;
  bool no_guides = false, clean_guides = false, check = false, quiet = false, force = false, overwrite = false;
  FrameOptions of_frames;
  std::shared_ptr<const History> history;  ///< of the frame being denoised

  DenoiseOptions denoiser() const { return {oidn}; }
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
             path, replaced.size(), image.data.size() / 3, kMostOfPicture, replaced[0].x, replaced[0].y);
}

/// The guide layers, each averaged over the files that have it.
class GuideLayers {
 public:
  std::optional<Image> albedo, normal, position;

  /// `colours`: of the picture.
  GuideLayers(const Options& o, const ColourSpace& colours) {
    if (o.no_guides) return;
    for (const std::string& path : o.inputs) {
      const ImageInfo info = inspect_image(path);
      add(path, guide(path, info, o, o.albedo, GuideKind::kAlbedo, colours), albedo, n_albedo_);
      add(path, guide(path, info, o, o.normal, GuideKind::kNormal, colours), normal, n_normal_);
      add(path, find_guide(path, info, GuideKind::kPosition, colours, o.layer), position, n_position_);
    }
    divide(albedo, n_albedo_);
    divide(normal, n_normal_);
    divide(position, n_position_);
    if (!albedo) normal.reset();  // Open Image Denoise only takes normals together with an albedo
  }
  Guides view() const {
    const auto or_null = [](const std::optional<Image>& image) { return image ? &*image : nullptr; };
    return {or_null(albedo), or_null(normal), nullptr, nullptr, or_null(position)};
  }
  const char* text() const {
    return normal ? "guided by albedo and normal" : albedo ? "guided by albedo" : "without guides";
  }

 private:
  static std::optional<Image> guide(const std::string& path, const ImageInfo& info, const Options& o,
                                    const std::string& name, GuideKind kind, const ColourSpace& colours) {
    if (name.empty()) return find_guide(path, info, kind, colours, o.layer);
    return named_guide(path, info, kind, colours, name);
  }

  static void add(const std::string& path, std::optional<Image> layer, std::optional<Image>& sum, float& n) {
    if (!layer) return;
    n += 1;
    if (!sum)
      sum = std::move(layer);
    else if (sum->data.size() != layer->data.size())
      throw Error(ErrorCode::kInput, fmt::format("'{}' has {} x {} pixels, others have {} x {}", path, layer->width,
                                                 layer->height, sum->width, sum->height));
    else
      std::transform(sum->data.begin(), sum->data.end(), layer->data.begin(), sum->data.begin(), std::plus<>());
  }

  static void divide(std::optional<Image>& sum, float n) {
    if (sum)
      for (float& value : sum->data) value /= n;
  }

  float n_albedo_ = 0, n_normal_ = 0, n_position_ = 0;
};

/// Writes the result in place of the picture of the first input.
void write(const Options& o, const ImagePlace& place, const std::map<std::string, std::string>& attributes,
           EstimatorResult& result, std::map<std::string, Image> layers, const ResultSource& source,
           ProgressLine& progress) {
  const std::vector<std::string> lost = write_result(o.output, place, attributes, result, layers, source);
  progress.finish();
  for (const std::string& what : lost) fmt::print(stderr, "warning: {}\n", what);
}

void denoise_by_network(const Options& o, const GuideLayers& guides, ProgressLine& progress) {
  const Stopwatch watch;
  const std::string& input = o.inputs[0];
  const ImageInfo info = inspect_image(input);
  constexpr double kImages = 4 * 3 * sizeof(float), kNetworkBytes = 600;  // per pixel: image, guides and result
  require_image_memory(input, info.place.window.width, info.place.window.height, kImages + kNetworkBytes);
  const PlacedImage image = read_image(input, o.layer, ChecksumPolicy::kCheck, std::nullopt);
  warn_of_values(input, image.image);
  if (const std::string by = denoised_by(info.attributes, info.channels); !by.empty())
    fmt::print(stderr, "warning: {} is denoised already ({}); give the render before denoising\n", input, by);
  progress.begin("denoising");
  Denoiser denoiser(o.denoiser());
  std::optional<Image> albedo = guides.albedo, normal = guides.normal;
  if (o.clean_guides && albedo) albedo = denoiser.denoise_guide("albedo", *albedo);
  if (o.clean_guides && normal) normal = denoiser.denoise_guide("normal", *normal);
  Image result =
      denoiser.denoise(image.image, albedo ? &*albedo : nullptr, normal ? &*normal : nullptr, o.clean_guides);
  progress.begin("writing");
  std::map<std::string, std::string> attributes = inherited_attributes(o.inputs);
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  attributes["covary:denoiser"] = "Open Image Denoise " + denoiser_info(o.denoiser()).version;
  const std::vector<std::string> picture = layer_channels(input, info.channels, o.layer);
  EstimatorResult denoised;
  denoised.estimate = std::move(result);
  write(o, image.place, attributes, denoised, {}, {o.inputs, {picture[0], picture[1], picture[2]}, {}}, progress);
  if (!o.quiet)
    fmt::print(stderr, "{}: {} x {}, {}, in {:.2f} s\n", o.output, image.image.width, image.image.height, guides.text(),
               watch.seconds());
}

void write_statistics(const Options& o, const CombineRequest& request, const CombinedImage& combined,
                      const DenoisingChoice& choice) {
  if (o.json.empty()) return;
  nlohmann::ordered_json json{
      {"output", o.output},
      {"estimator", request.estimator.text},
      {"width", request.independent.width},
      {"height", request.independent.height},
      {"independent_groups", request.independent.groups},
      {"nonfinite_pixels", combined.image.nonfinite_pixels},
      {"seconds", {{"read_and_check", combined.check_seconds}, {"estimate", combined.estimate_seconds}}}};
  if (combined.predicted) add_prediction(*combined.predicted, json);
  add_risks(combined.image.risks, json);
  add_network(request.estimator.network, combined.image.network_runs, choice, json);
  if (!combined.image.note.empty()) json["note"] = combined.image.note;
  write_text_output(o.json, json_text(json));
}

void denoise_by_mixture(const Options& o, const GroupedFile& file, const GuideLayers& guides, ProgressLine& progress) {
  CombineRequest request;
  request.independent = source_of(file);
  const DenoisingChoice choice{o.mode.empty() ? usual_denoising(kDefaultEstimator) : o.mode, o.oidn, {o.history}};
  request.estimator = make_default_estimator(false, {}, choice);
  request.settings.std_error = true;
  request.settings.guides = guides.view();
  std::deque<GroupedFile> layers;
  for (const std::string& name : o.layers)
    request.layers.push_back({name, source_of(layers.emplace_back(o.inputs, name))});
  request.force = o.force;
  request.checked = [&](const InputFindings& found) {
    progress.clear();
    print_findings(found.findings, o.force, o.quiet);
    progress.begin("denoising");
  };
  CombinedImage combined = combine(request);
  progress.begin("writing");
  std::map<std::string, std::string> attributes = inherited_attributes(o.inputs);
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  attributes["covary:estimator"] = request.estimator.text;
  if (!request.estimator.network.empty()) attributes["covary:denoiser"] = request.estimator.network;
  if (file.samples() > 0) attributes["covary:samples"] = fmt::to_string(file.samples());
  write(o, file.place(), attributes, combined.image, std::move(combined.layers), file.source(), progress);
  write_statistics(o, request, combined, choice);
  if (o.quiet) return;
  fmt::print(stderr, "{}: {} x {}, {} of {} groups, {}, in {:.2f} s\n", o.output, file.width(), file.height(),
             request.estimator.text, file.groups(), guides.text(), combined.check_seconds + combined.estimate_seconds);
  print_risks(combined, choice);
}

/// Whether the options select the network alone, whatever the image.
bool is_by_network(const Options& o) { return o.mode == kNetwork || (o.mode.empty() && o.clean_guides); }

void check_options(const Options& o) {
  const auto usage = [](const std::string& message) { throw Error(ErrorCode::kUsage, message); };
  if (o.inputs.empty() || o.output.empty()) usage("expected IN.exr and -o OUT.exr, or --check");
  if (o.no_guides && !(o.albedo + o.normal).empty()) usage("--albedo and --normal have no effect with --no-guides");
  if (o.no_guides && o.clean_guides) usage("--clean-guides has no effect with --no-guides");
  for (size_t i = 0; i < o.inputs.size(); ++i)
    for (size_t k = 0; k < i; ++k)
      if (is_same_file(o.inputs[i], o.inputs[k]))
        usage(fmt::format("'{}' and '{}' are the same file; renders of different seeds are needed", o.inputs[k],
                          o.inputs[i]));
  if (o.inputs.size() > 1 && is_by_network(o))
    usage("--mode oidn and --clean-guides are for one image; covary merge makes one of films");
  if (o.clean_guides && !is_by_network(o))
    usage("--clean-guides is an option of --mode oidn; mixtures always denoise their guides first");
}

void run_one(const Options& o) {
  check_options(o);
  Outputs outputs;
  outputs.reads(o.inputs);
  outputs.writes_result("-o", o.output, OutputKind::kFilm, "denoise", o.overwrite);
  outputs.writes("--json", o.json, OutputKind::kText);
  ProgressLine progress(std::filesystem::path(o.inputs[0]).stem().string(), o.quiet);
  progress.begin("loading");
  std::optional<GroupedFile> file;
  if (!is_by_network(o)) file.emplace(o.inputs, o.layer);
  const GuideLayers guides(o, file ? file->colours() : ImageRows(o.inputs[0], o.layer).colours());
  if (file && file->groups() < 2 && !o.mode.empty())
    throw Error(ErrorCode::kUsage, fmt::format("--mode {} needs a second render of another seed, or a film with two "
                                               "groups or more (--groups); '{}' has one",
                                               o.mode, o.inputs[0]));
  if (!o.layers.empty() && (!file || file->groups() < 2))
    throw Error(ErrorCode::kUsage, "--layers are denoised by a mixture, which needs a second render of another seed");
  if (!o.json.empty() && (!file || file->groups() < 2))
    throw Error(ErrorCode::kUsage, "--json tells the error, which needs a second render of another seed");
  if (!file || file->groups() < 2) return denoise_by_network(o, guides, progress);
  denoise_by_mixture(o, *file, guides, progress);
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
    run_one(one);
  });
}

void run(const Options& o) {
  if (o.check) return check(o);
  const FramePatterns patterns{o.inputs, {}, o.output, o.layer};
  are_frames(o.of_frames, patterns) ? run_sequence(o, patterns) : run_one(o);
}

}  // namespace

void add_denoise(CLI::App& app) {
  const auto o = std::make_shared<Options>();
  CLI::App* command = app.add_subcommand("denoise", "Denoise an image, or several renders of different seeds");
  add_value(*command, "IN", o->inputs, kFileValue,
            "Linear image (EXR), guided by its albedo and normal layers, whatever the renderer calls them. Several "
            "renders that differ only in their seed, or a film with groups, give a better image and its error")
      ->expected(1, 1000);
  add_value(*command, "-o,--output", o->output, kFileValue, "The result (EXR)");
  add_value(*command, "--layer", o->layer, "LAYER",
            "Layer of the picture, e.g. a view or a view layer, if the files hold several");
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
  add_value(*command, "--layers", o->layers, "LAYER",
            "Layers of the inputs to denoise with the picture's weights; with Rest, they add up to it")
      ->delimiter(',');
  command->add_flag("--no-guides", o->no_guides, "Do not use guides");
  command->add_flag(
      "--clean-guides", o->clean_guides,
      "With --mode oidn, denoise the guides first: less error if they are noisy, in three times the time");
  add_value(*command, "--json", o->json, kFileValue, "File for statistics of a mixture; '-': standard output");
  add_frame_options(*command, o->of_frames, "Denoise");
  add_overwrite_option(*command, o->overwrite);
  command->add_flag("--force", o->force, "Denoise even if the renders do not match");
  command->add_flag("--quiet", o->quiet, "No summary");
  command->callback([o] { run(*o); });
}

}  // namespace covary
