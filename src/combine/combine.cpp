// SPDX-License-Identifier: Apache-2.0
#include "combine/combine.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <utility>

#include "combine/difference_checks.h"
#include "combine/light_film.h"
#include "combine/same_seed.h"
#include "core/error.h"
#include "core/memory_limit.h"
#include "core/stop.h"
#include "core/stopwatch.h"
#include "denoising/mixing_memory.h"
#include "denoising/mixture_name.h"
#include "denoising/network_memory.h"
#include "denoising/row_bands.h"
#include "estimators/mean.h"
#include "estimators/result_rows.h"
#include "filters/planes.h"
#include "filters/regression.h"
#include "filters/residual_correction.h"
#include "risk/error_interval.h"
#include "risk/predicted_error.h"

namespace covary {
namespace {

constexpr int kLightRows = 64;  // rows of the light film in memory at a time
constexpr int kMinRows = 16;
/// Bands that share more than pixels have at least so many times the rows around them, if memory allows: a part of the
/// work on those is done twice.
constexpr int kUsefulRows = 5;
constexpr double kImagesOfLayer = 12;

int groups_of(const std::optional<GroupedSource>& source) { return source ? source->groups : 0; }

/// Layers and history are made of whole images.
bool needs_whole(const CombineRequest& request) { return request.estimator.halo < 0 || !request.layers.empty(); }

GroupedImage rows_of(const std::optional<GroupedSource>& source, int first, int n) {
  return source ? source->rows(first, n) : GroupedImage{};
}

void throw_errors(const InputFindings& inputs) {
  if (const std::string errors = errors_text(inputs.findings); !errors.empty())
    throw Error(ErrorCode::kInput, "the inputs do not fit: " + errors);
}

/// "2 renders", "12 + 12 groups"
std::string inputs_text(const CombineRequest& request) {
  const int crn = groups_of(request.crn), n = request.independent.groups;
  if (request.crn) return fmt::format("{} + {} groups", crn, n);
  return fmt::format("{} {}", n, request.independent.origin.renders.empty() ? "groups" : "renders");
}

void check_memory(const CombineRequest& request, double planned) {
  if (planned <= std::max(kMinMemoryLimit, request.max_memory.value_or(memory_limit()))) return;
  throw Error(
      ErrorCode::kUsage,
      fmt::format(
          "{} x {} pixels of {} need {}{} of memory for {}{}; {}", request.independent.width,
          request.independent.height, inputs_text(request), needs_whole(request) ? "" : "at least ",
          bytes_text(planned), request.estimator.text, needs_whole(request) ? ", which works on whole images" : "",
          request.max_memory ? bytes_text(*request.max_memory) + " are allowed (`memory`)" : memory_limit_text()));
}

/// The light film's error is its variance alone and is added to every image. `before`: the error predicted without it.
void add_risk_of_light(double before, EstimatorResult& result) {
  if (!result.risks) return;
  const double after = predicted_relmse(result);
  if (after > 0) result.risks->bias_share *= before / after;
  for (MeasuredRisks::OfImage& image : result.risks->images) image.relmse += after - before;
}

/// Bytes per pixel of a layer during denoising: its groups, copies of them, and its images.
double layer_bytes(int groups) { return 3 * sizeof(float) * (2.0 * groups + kImagesOfLayer); }

/// Estimates the whole image with all layers.
MethodImage estimate_layers(const CombineRequest& request, std::map<std::string, Image>& layers) {
  if (!request.estimator.splits_layers())
    throw Error(ErrorCode::kUsage,
                fmt::format("{} makes no `layers`; denoised independent images have them", request.estimator.text));
  const GroupedImage independent = request.independent.all();
  const WholeLayers whole(independent, request.layers);
  MethodSettings settings = request.settings;
  settings.layers = whole.view();
  MethodImage result = request.estimator.image({rows_of(request.crn, 0, independent.height), independent}, settings);
  for (size_t i = 0; i < result.layers.size(); ++i) layers[whole.view()[i].name] = std::move(result.layers[i]);
  result.layers.clear();
  return result;
}

MethodImage estimate(const CombineRequest& request) {
  const Method& estimator = request.estimator;
  const int height = request.independent.height, in_memory = rows_in_memory(request);
  if (needs_whole(request) || in_memory >= height)
    return estimator.image({rows_of(request.crn, 0, height), request.independent.all()}, request.settings);
  if (estimator.image_in_rows) {
    const auto rows = [&](int first, int n) {
      return Samples{rows_of(request.crn, first, n), request.independent.rows(first, n)};
    };
    return estimator.image_in_rows({request.independent.width, height, in_memory, rows}, request.settings);
  }
  const int step = std::max(kMinRows, in_memory - 2 * estimator.halo) / kResidualCell * kResidualCell;
  MethodImage whole;
  for (int y = 0; y < height; y += step) {
    const int n = std::min(step, height - y);
    const Band band = band_around(request, y, y + n);
    const MethodImage part = estimator.image({band.crn, band.independent}, request.settings);
    long n_nonfinite = 0;  // without the surrounding rows, which belong to other bands
    finite_pixels(covary::rows_of(band.crn, y - band.first, n), covary::rows_of(band.independent, y - band.first, n),
                  n_nonfinite);
    whole.nonfinite_pixels += n_nonfinite;
    append_rows(part, y - band.first, y, n, height, whole);
  }
  return whole;
}

/// The default, of independent samples alone.
bool mixes_mean(const CombineRequest& request) { return request.estimator.name == kMixture && !request.crn; }

/// What it takes for so many pixels, all of the image's or those of a band.
double memory_of_mixture(const CombineRequest& request, double n_pixels) {
  const GroupedSource& image = request.independent;
  const MixtureSize size{image.groups, request.settings.features.albedo != nullptr, !request.estimator.network.empty()};
  const double mixed = n_pixels * bytes_of_mixture(size);
  const bool is_whole = n_pixels >= static_cast<double>(image.width) * image.height;
  return size.has_network && is_whole ? std::max(mixed, memory_beside_network(size, n_pixels)) : mixed;
}

}  // namespace

double memory_of_rows(const CombineRequest& request, int rows) {
  constexpr double kImage = 3 * sizeof(float), kCount = sizeof(uint32_t);
  const double width = request.independent.width, n_pixels = width * rows;
  const int crn_groups = groups_of(request.crn), all_groups = crn_groups + request.independent.groups;
  const bool holds_out = request.settings.std_error && request.settings.held_out;
  const int groups = holds_out ? std::min(request.crn ? crn_groups : all_groups, request.independent.groups) : 0;
  const double values = kImage * all_groups + 2 * kCount;
  const Features& features = request.settings.features;
  double n_features = 0;                 // as images of floats
  constexpr double kOfDifference = 0.5;  // of 16 bits
  for (size_t i = 0; i < feature::kCount; ++i) {
    n_features += features.*kImagesOfFeatures[i] != nullptr;
    if (features.differences) n_features += features.differences->values[i].empty() ? 0 : kOfDifference;
  }
  const bool in_bands = rows < request.independent.height;
  // For bands: the estimate of the whole image; its standard error and bias are stored beside them.
  const double of_whole = n_features * kImage + (in_bands ? 3 * kImage + request.estimator.memory.of_whole : 0);
  const double library = request.estimator.network.empty() ? 0 : network_library_memory();
  const double kept =
      in_bands && rows > 0 && request.estimator.image_in_rows ? memory_of_kept_rows(request.estimator.halo, width) : 0;
  const double results = of_whole * width * request.independent.height + library + kept;
  const double layers = request.layers.empty() ? 0 : static_cast<double>(request.layers.size() + 1);
  const double of_method =
      mixes_mean(request) ? memory_of_mixture(request, n_pixels) : request.estimator.memory.bytes(n_pixels, groups);
  return n_pixels * (values + layers * layer_bytes(request.independent.groups) + (in_bands ? n_features * kImage : 0)) +
         of_method + results;
}

namespace {

/// Rows of bands that need no more memory.
int rows_within(const CombineRequest& request, double memory) {
  const int height = request.independent.height;
  if (memory_of_rows(request, height) <= memory) return height;
  const double row = memory_of_rows(request, 2) - memory_of_rows(request, 1),
               results = memory_of_rows(request, 1) - row;
  return static_cast<int>(std::clamp((memory - results) / row, 0.0, height - 1.0));
}

double max_memory_of(const CombineRequest& request) { return request.max_memory.value_or(memory_limit()); }

}  // namespace

int rows_in_memory(const CombineRequest& request) {
  const int rows = rows_within(request, request.memory);
  if (!request.estimator.image_in_rows || needs_whole(request)) return rows;
  const int useful = kUsefulRows * request.estimator.halo;
  if (rows >= useful) return rows;
  return std::max(rows, std::min(useful, rows_within(request, max_memory_of(request))));
}

double planned_memory(const CombineRequest& request) {
  const int height = request.independent.height, halo = request.estimator.halo;
  const int cells = kRegressionCell + (request.estimator.image_in_rows ? kBandCell : 0);
  const int fewest = needs_whole(request) ? height : std::min(height, kMinRows + cells + 2 * halo);
  const int rows = std::max(fewest, rows_in_memory(request));
  const double of_rows = memory_of_rows(request, rows);
  if (request.estimator.network.empty() || rows >= height) return of_rows;
  // The network denoises the whole image before there are bands.
  const double n_pixels = static_cast<double>(request.independent.width) * height;
  return std::max(of_rows, memory_of_rows(request, 0) + network_tile_memory(n_pixels));
}

void limit_memory(CombineRequest& request, std::optional<double> mebibytes) {
  constexpr double kMebibyte = 1 << 20, kDefault = 6144 * kMebibyte;
  if (mebibytes) request.max_memory = *mebibytes * kMebibyte;
  request.memory = request.max_memory.value_or(std::min(kDefault, memory_limit()));
}

Band band_around(const CombineRequest& request, int first, int last) {
  // Start at a multiple of the cells of the residual correction.
  const int begin = std::max(0, first - request.estimator.halo) / kResidualCell * kResidualCell;
  const int n = std::min(request.independent.height, last + request.estimator.halo) - begin;
  return {rows_of(request.crn, begin, n), request.independent.rows(begin, n), begin};
}

namespace {

/// The groups that may have been rendered with the same seed; those of a film have different samples.
int groups_with_seeds(const std::optional<GroupedSource>& source) {
  return source && !source->origin.is_one_film ? source->groups : 0;
}

void check_denoised(const ImageOrigin& origin, int groups, std::vector<Finding>& findings) {
  if (origin.denoised.empty() || groups < 2) return;
  findings.push_back(
      {Finding::Severity::kError,
       fmt::format("{} is denoised already ({}): what is left of the noise does not tell its error; give "
                   "the renders before denoising ({})",
                   origin.name, origin.denoised, where_to_set(RenderSetting::kNoDenoiser, origin.renderer))});
}

/// What messages call the images: with a CRN image, by their roles and files.
ImageNames names_of(const ImageOrigin& origin, const char* role) {
  const bool has_files = origin.renders.size() > 1;
  const std::string name = *role ? role + (has_files ? fmt::format(" ({})", origin.name) : std::string())
                                 : (has_files ? "the renders" : origin.name);
  return {name, origin.renders, origin.renderer};
}

void report(const std::vector<StrayValue>& strays, const ImageNames& names, std::vector<Finding>& findings) {
  if (strays.empty()) return;
  const StrayValue& s = strays.front();
  findings.push_back({Finding::Severity::kWarning,
                      fmt::format("{}: {} value{} that outshine{} the whole picture {:.0f} times {} left out, "
                                  "the largest of {:.3g} at ({}, {}) in {}; find the cause in the renderer",
                                  names.image, strays.size(), strays.size() == 1 ? "" : "s",
                                  strays.size() == 1 ? "s" : "", kMaxOfPicture, strays.size() == 1 ? "is" : "are",
                                  s.brightness, s.x, s.y, names.render(static_cast<size_t>(s.group)))});
}

/// The source with its known number of samples in each pixel, where rows do not tell it.
GroupedSource with_counts(const GroupedSource& source) {
  if (source.samples <= 0) return source;
  GroupedSource result = source;
  result.rows = [source, counts = std::make_shared<std::vector<uint32_t>>()](int first, int n) {
    GroupedImage image = source.rows(first, n);
    if (image.counts) return image;
    counts->assign(static_cast<size_t>(image.width) * image.height,
                   static_cast<uint32_t>(std::llround(source.samples)));
    image.counts = counts->data(), image.mean_count = source.samples;
    return image;
  };
  return result;
}

/// The source with these values set to NaN.
GroupedSource without(const GroupedSource& source, const std::vector<StrayValue>& strays) {
  if (strays.empty()) return source;
  GroupedSource result = source;
  result.rows = [rows = source.rows, strays, data = std::make_shared<std::vector<float>>()](int first, int n) {
    GroupedImage image = rows(first, n);
    data->assign(image.data, image.pixel(0, n));
    leave_out(strays, first, n, image.width, image.groups, data->data());
    image.data = data->data();
    return image;
  };
  return result;
}

/// Whether a method of one pass gets the sum of samples and light film, and so denoises light paths, too, as renders do
/// (denoises_light() of plans/light_plan.h); otherwise the light film is added to its image.
bool adds_light_first(const CombineRequest& request) {
  return request.light && !request.crn && request.estimator.one_pass() &&
         request.light->groups == request.independent.groups;
}

}  // namespace

InputFindings examine(const CombineRequest& request) {
  const GroupedSource& independent = request.independent;
  const ImageOrigin& crn_origin = request.crn ? request.crn->origin : independent.origin;
  InputFindings inputs;
  if (request.crn) check_origins(crn_origin, independent.origin, inputs.findings);
  check_light(crn_origin, independent.origin, request.light ? &request.light->origin : nullptr, inputs.findings);
  InputChecks checks(independent.width, independent.height, request.crn ? request.crn->groups : 0, independent.groups);
  // Only for images of other renderers: covary's films say how they were made.
  const bool by_others = !request.crn && independent.origin.sampling.empty();
  DifferenceChecks differences(independent.width, independent.height, by_others ? independent.groups : 0);
  if (request.crn) check_denoised(crn_origin, request.crn->groups, inputs.findings);
  check_denoised(independent.origin, independent.groups, inputs.findings);
  SameSeedChecks crn_seeds(independent.width, independent.height, groups_with_seeds(request.crn));
  SameSeedChecks seeds(independent.width, independent.height, groups_with_seeds(independent));
  LayerChecks layers(request.layers);
  StrayValues of_crn, of_independent;
  const int step = std::max(kMinRows, rows_in_memory(request));
  bool checkable = true;
  for (int y = 0; y < independent.height && checkable; y += step) {
    const int n = std::min(step, independent.height - y);
    const GroupedImage g = rows_of(request.crn, y, n), h = independent.rows(y, n);
    checkable = !request.estimator.adaptive || (!lacks_samples(g) && !lacks_samples(h));
    if (checkable) checks.add_rows(g, h);
    differences.add_rows(h);
    layers.add_rows(y, h);
    crn_seeds.add_rows(g), seeds.add_rows(h);
    of_crn.add_rows(g), of_independent.add_rows(h);
  }
  const ImageNames crn_names = names_of(crn_origin, "CRN image"),
                   names = names_of(independent.origin, request.crn ? "independent image" : "");
  inputs.report = checkable ? checks.report(crn_names, names) : unchecked_report();
  crn_seeds.report(crn_names, inputs.report.findings), seeds.report(names, inputs.report.findings);
  if (errors_text(inputs.report.findings).empty()) differences.report(names, inputs.report.findings);
  inputs.strays_of_crn = of_crn.found(), inputs.strays = of_independent.found();
  report(inputs.strays_of_crn, crn_names, inputs.report.findings);
  report(inputs.strays, names, inputs.report.findings);
  layers.report(names, inputs.report.findings);
  inputs.findings.insert(inputs.findings.end(), inputs.report.findings.begin(), inputs.report.findings.end());
  return inputs;
}

double predicted_relmse_of_mean(const GroupedSource& image, int rows) {
  double sum = 0;
  for (int y = 0; y < image.height; y += rows) {
    const int n = std::min(rows, image.height - y);
    sum += n * predicted_relmse(mean_of_groups(image.rows(y, n)));
  }
  return sum / image.height;
}

EstimatorResult finish(MethodImage image, const GroupedImage* light) {
  EstimatorResult result = with_error(std::move(image));
  if (!light) return result;
  const double before = result.risks ? predicted_relmse(result) : 0;
  add_light(*light, result);
  add_risk_of_light(before, result);
  return result;
}

namespace {

CombinedImage combine_to_the_end(const CombineRequest& asked) {
  if (asked.estimator.name.empty())
    throw Error(ErrorCode::kUsage, "no `estimator`; make_default_estimator() and make_estimator() make one");
  CombineRequest given = asked;
  if (!given.crn) given.independent = with_counts(given.independent);
  CombinedImage combined;
  combined.planned_memory = planned_memory(given);
  check_memory(given, combined.planned_memory);
  Stopwatch watch;
  combined.inputs = examine(given);
  if (given.checked) given.checked(combined.inputs);
  if (!given.force) throw_errors(combined.inputs);
  CombineRequest request = given;
  if (request.crn) request.crn = without(*request.crn, combined.inputs.strays_of_crn);
  request.independent = without(request.independent, combined.inputs.strays);
  combined.check_seconds = watch.lap();
  if (adds_light_first(request)) {
    request.independent = with_light(request.independent, *request.light);
    request.light.reset();
  }

  combined.image = finish(request.layers.empty() ? estimate(request) : estimate_layers(request, combined.layers));
  const double before = combined.image.risks && request.light ? predicted_relmse(combined.image) : 0;
  if (request.light)
    for (int y = 0; y < request.light->height; y += kLightRows)
      add_light(request.light->rows(y, std::min(kLightRows, request.light->height - y)), combined.image, y);
  if (request.light) add_risk_of_light(before, combined.image);
  const double crn = request.crn ? request.crn->samples : 0, samples = crn + request.independent.samples;
  const bool counted = (crn > 0 || !request.crn) && request.independent.samples > 0;
  combined.predicted = predicted_error(combined.image, counted ? samples : std::numeric_limits<double>::infinity(),
                                       request.estimator.reliable_samples);
  combined.estimate_seconds = watch.lap();
  return combined;
}

}  // namespace

CombinedImage combine(const CombineRequest& request) {
  CombinedImage combined;
  combined.interrupted = !run_stoppable(request.stop, [&] { combined = combine_to_the_end(request); });
  return combined;
}

}  // namespace covary
