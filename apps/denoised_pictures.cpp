// SPDX-License-Identifier: Apache-2.0
#include "denoised_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "combine/beauty_layers.h"
#include "combine/combine.h"
#include "commands.h"
#include "core/error.h"
#include "core/memory_limit.h"
#include "core/printable.h"
#include "core/stopwatch.h"
#include "denoising/mixed_denoising.h"
#include "feature_layers.h"
#include "film/denoised_by.h"
#include "film/exr_copy.h"
#include "film/image_rows.h"
#include "film/written_by.h"
#include "filters/stray_values.h"
#include "json_output.h"
#include "metrics/alignment.h"
#include "metrics/provenance.h"
#include "network_memory.h"
#include "risk_report.h"
#include "usage_error.h"
#include "value_names.h"

namespace covary {
namespace {

void warn_of_values(const std::string& path, const Image& image) {
  std::vector<StrayValue> replaced;
  with_usable_values(image, &replaced);
  if (replaced.empty()) return;
  fmt::print(stderr,
             "warning: {}: {} of {} pixels hold values that are NaN, infinite, overflow or outshine the whole picture "
             "{:.0f} times, the first at ({}, {}); the pixels around replace them\n",
             path, replaced.size(), image.data.size() / 3, kMaxOfPicture, replaced[0].x, replaced[0].y);
}

std::map<std::string, std::string> new_attributes(const DenoiseCommand& o) {
  std::map<std::string, std::string> attributes = inherited_attributes(o.inputs);
  attributes["covary:version"] = COVARY_VERSION;
  attributes["covary:command"] = command_line();
  return attributes;
}

/// The mean over files of a layer, in the values that they store.
Image mean_of(const std::vector<std::string>& paths, const std::string& layer) {
  const ImagePlace place = inspect_image(paths[0]).place;
  MeanFeature mean;
  for (const std::string& path : paths) {
    PlacedImage image = read_image(path, layer, ChecksumPolicy::kCheck, std::nullopt);
    if (!(image.place == place))
      throw Error(ErrorCode::kInput, fmt::format("'{}' has the pixels {}, '{}' has {}, or another frame around them",
                                                 path, text_of(image.place.window), paths[0], text_of(place.window)));
    warn_of_values(path, image.image);
    if (paths.size() == 1) return std::move(image.image);
    mean.add(path, with_usable_values(std::move(image.image)));
  }
  return mean.take_mean();
}

/// Alpha as an image; empty if it is 0 or 1 everywhere, with nothing to denoise.
Image partial_alpha(const std::vector<std::string>& paths, const std::string& channel) {
  Image alpha = mean_of(paths, channel);
  const bool partial = std::any_of(alpha.data.begin(), alpha.data.end(), [](float a) { return a > 0 && a < 1; });
  return partial ? alpha : Image();
}

Image as_alpha(const Image& grey) {
  Image alpha(grey.width, grey.height, 1);
  for (size_t i = 0; i < alpha.data.size(); ++i) alpha.data[i] = std::clamp(grey.data[3 * i], 0.0f, 1.0f);
  return alpha;
}

nlohmann::ordered_json statistics(const DenoiseCommand& o, const CombineRequest& request, const CombinedImage& combined,
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
  if (o.target) json["device"] = o.target->made_by().empty() ? gpu::kProcessor : o.target->made_by();
  if (!combined.image.note.empty()) json["note"] = combined.image.note;
  return json;
}

}  // namespace

std::vector<DenoiseTask> tasks_of(const DenoiseCommand& o) {
  const std::vector<ExrFile::Channel> channels = inspect_image(o.inputs[0]).channels;
  std::vector<Picture> pictures = find_pictures(channels);
  if (!o.choice.layer.empty() || !o.choice.view.empty() || pictures.empty())
    pictures = is_unnamed(o.choice) ? std::vector<Picture>(1) : chosen_pictures(o.inputs[0], channels, o.choice);
  std::vector<DenoiseTask> tasks;
  for (const Picture& picture : pictures) {
    const std::string noisy = picture.layer == o.choice.layer ? "" : noisy_layer(picture, channels);
    if (!noisy.empty())
      fmt::print(stderr, "note: {}: '{}' is denoised already; '{}' beside it, which is not, is denoised instead\n",
                 printable(o.inputs[0]), picture.layer, noisy);
    tasks.push_back({picture, noisy.empty() ? picture.layer : noisy, pictures.size() == 1});
  }
  return tasks;
}

Denoised denoise_by_network(const DenoiseCommand& o, const DenoiseTask& task, ProgressLine& progress) {
  const Stopwatch watch;
  const std::string& input = o.inputs[0];
  if (!DenoisingChoice{"auto", o.oidn, {}}.uses_oidn())
    usage("'" + input +
          "' is one image, which only Open Image Denoise denoises: leave out --oidn off, or give a "
          "second render of another seed, too");
  const ImageInfo info = inspect_image(input);
  require_memory_of_network(input, info.place.window, o.memory_mib);
  const ColourSpace colours = ImageRows(input, task.layer).colours();
  FeatureLayers features({o.inputs, task.picture, colours, o.albedo, o.normal, o.no_features}, false);
  const Image image = mean_of(o.inputs, task.layer);
  for (const std::string& path : o.inputs) {
    const ImageInfo of_file = inspect_image(path);
    if (const std::string by = denoised_by(of_file.attributes, of_file.channels, task.layer); !by.empty())
      fmt::print(stderr, "warning: {} is denoised already ({}); give the render before denoising ({})\n", path, by,
                 where_to_set(RenderSetting::kNoDenoiser, written_by(of_file.attributes)));
  }
  progress.begin("denoising");
  Denoiser denoiser(o.denoiser());
  const std::string guided = features.text();
  const auto taken = [&](const char* name, feature::Index kind) -> std::shared_ptr<const Image> {
    std::optional<Image> feature = features.take(kind);
    if (!feature) return nullptr;
    return std::make_shared<const Image>(o.clean_features ? denoiser.denoise_feature(name, std::move(*feature))
                                                          : std::move(*feature));
  };
  const std::shared_ptr<const Image> albedo = taken("albedo", feature::kAlbedo),
                                     normal = taken("normal", feature::kNormal);
  const auto denoised = [&](const Image& noisy) { return denoiser.denoise(noisy, albedo, normal, o.clean_features); };
  Denoised result;
  const std::vector<std::string> picture = layer_channels(input, info.channels, task.picture.layer);
  result.result.image.estimate = denoised(image);
  result.result.source = {o.inputs, {picture[0], picture[1], picture[2]}, {}, task.prefix()};
  const std::string alpha = is_exr_image(input) ? alpha_channel(info.channels, picture[0]) : "";
  if (Image values = alpha.empty() ? Image() : partial_alpha(o.inputs, alpha); !values.data.empty())
    result.result.aovs[alpha] = as_alpha(denoised(values));
  result.attributes = new_attributes(o);
  result.attributes["covary:denoiser"] = "Open Image Denoise " + denoiser_info(o.denoiser()).version;
  const auto seeds = info.attributes.find(std::string("covary:") + film_key::kSeed);
  const bool is_for_one_group = o.mode.empty() && !o.clean_features;  // and not because the network is asked for
  const bool merged =
      is_for_one_group && seeds != info.attributes.end() && seeds->second.find(',') != std::string::npos;
  result.report = [=, width = image.width, height = image.height, seconds = watch.seconds()] {
    fmt::print(stderr, "{}{}: {} x {}, {}, in {:.2f} s\n{}", o.output, task.text(), width, height, guided, seconds,
               o.inputs.size() > 1 ? ""
               : merged            ? kErrorOfMerged
                                   : kErrorOfOneRender);
  };
  return result;
}

Denoised denoise_by_mixture(const DenoiseCommand& o, const DenoiseTask& task, const FrameFile& frame,
                            ProgressLine& progress) {
  const GroupedFile& file = frame.file();
  CombineRequest request;
  request.independent = frame.source();
  const DenoisingChoice choice = o.mixing();
  request.estimator = make_default_estimator(false, {}, choice, o.target);
  request.settings.std_error = true;
  FeatureLayers features({o.inputs, task.picture, file.colours(), o.albedo, o.normal, o.no_features},
                         file.groups() == static_cast<int>(o.inputs.size()));
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
  result.attributes.erase("covary:device");
  if (o.target && !o.target->made_by().empty()) result.attributes["covary:device"] = o.target->made_by();
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

}  // namespace covary
