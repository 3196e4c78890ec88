// SPDX-License-Identifier: Apache-2.0
// covary combine: image-space control variates for images made by any renderer.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <tbb/global_control.h>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "combine_counts.h"
#include "combine_light.h"
#include "commands.h"
#include "core/stopwatch.h"
#include "estimator_options.h"
#include "estimators/feedback.h"
#include "estimators/grouped_file.h"
#include "estimators/held_out_error.h"
#include "estimators/input_checks.h"
#include "estimators/mean.h"
#include "estimators/pair_input.h"
#include "estimators/planes.h"
#include "estimators/result_file.h"
#include "film/outputs.h"
#include "guide_layer.h"
#include "json_output.h"
#include "numbers.h"
#include "progress.h"
#include "stages.h"

namespace covary {
namespace {

struct CombineOptions {
  std::vector<std::string> crn, independent;
  std::string output, crn_layer, independent_layer, counts, light, guides, stages, json;
  EstimatorOptions estimator;
  bool error = false, force = false, quiet = false;
  std::optional<int> samples;
  double memory_mib = 4096;
  std::vector<int> explain;  ///< x, y in the full frame
  int threads = 0;
};

/// What the file tells beside its pixels.
ImageOrigin origin_of(const GroupedFile& file) {
  return {file.name(),     file.place(),    file.sampling(),      file.scene_hash(),
          file.settings(), file.has_half(), file.is_light_film(), file.has_light_added()};
}

/// Both images, some rows at a time.
class Bands {
 public:
  Bands(const GroupedFile& crn, const GroupedFile& independent, double memory_mib)
      : crn_(crn), independent_(independent) {
    // The values themselves, and about 40 floats per pixel that an estimator works with.
    const double row_bytes = crn.width() * (12.0 * (crn.groups() + independent.groups()) + 160);
    rows_ = static_cast<int>(std::min<double>(crn.height(), memory_mib * 1048576 / row_bytes));
  }
  /// Rows that fit in memory at once.
  int rows() const { return rows_; }
  void read(int first, int n) {
    if (first == first_ && n == n_) return;
    crn_.read_rows(first, n, crn_rows_);
    independent_.read_rows(first, n, independent_rows_);
    first_ = first;
    n_ = n;
  }
  /// Reads the rows first … last - 1 with `reach` more on both sides, beginning at a multiple of a cell of the
  /// feedback, so that bands give the bits of the whole. Returns the row that the band begins with.
  int read_around(int first, int last, int reach) {
    const int begin = std::max(0, first - reach) / kFeedbackCell * kFeedbackCell;
    read(begin, std::min(crn_.height(), last + reach) - begin);
    return begin;
  }
  GroupedImage crn() const { return crn_.view(crn_rows_, n_); }
  GroupedImage independent() const { return independent_.view(independent_rows_, n_); }

 private:
  const GroupedFile &crn_, &independent_;
  int rows_, first_ = -1, n_ = 0;
  GroupedFile::Rows crn_rows_, independent_rows_;
};

InputReport examine(const Estimator& estimator, const GroupedFile& crn, const GroupedFile& independent, Bands& bands) {
  InputChecks checks(crn.width(), crn.height(), crn.groups(), independent.groups());
  const int step = std::max(16, bands.rows());
  for (int y = 0; y < crn.height(); y += step) {
    bands.read(y, std::min(step, crn.height() - y));
    if (estimator.adaptive && (lacks_samples(bands.crn()) || lacks_samples(bands.independent())))
      return unchecked_report();
    checks.add_rows(bands.crn(), bands.independent());
  }
  return checks.report();
}

EstimatorResult estimate(const Estimator& estimator, const PairSettings& settings, const GroupedFile& file,
                         Bands& bands) {
  const int height = file.height();
  if (estimator.reach < 0 || bands.rows() >= height) {
    bands.read(0, height);
    return estimator.apply(bands.crn(), bands.independent(), settings);
  }
  const int step = std::max(16, bands.rows() - 2 * estimator.reach) / kFeedbackCell * kFeedbackCell;
  EstimatorResult whole;
  for (int y = 0; y < height; y += step) {
    const int first = bands.read_around(y, y + step, estimator.reach);
    const EstimatorResult part = estimator.apply(bands.crn(), bands.independent(), settings);
    long n_nonfinite = 0;  // without the rows around, which other bands count
    const auto own = [&](const GroupedImage& band) {
      return GroupedImage{band.width, std::min(height, y + step) - y, band.groups, band.pixel(0, y - first)};
    };
    finite_pixels(own(bands.crn()), own(bands.independent()), n_nonfinite);
    whole.nonfinite_pixels += n_nonfinite;
    const auto append = [&](const Image& from, Image& to) {
      if (from.data.empty()) return;
      if (to.data.empty()) to = Image(from.width, height, 3);
      std::copy_n(from.pixel(0, y - first), static_cast<size_t>(from.width) * 3 * (std::min(height, y + step) - y),
                  to.pixel(0, y));
    };
    append(part.estimate, whole.estimate);
    append(part.std_error, whole.std_error);
    append(part.bias, whole.bias);
    if (!part.held_out.empty())
      whole.held_out.insert(whole.held_out.end(), part.held_out.begin() + (y - first),
                            part.held_out.begin() + (std::min(height, y + step) - first));
  }
  return whole;
}

void write(const CombineOptions& o, const GroupedFile& crn, const GroupedFile& independent, EstimatorResult& result) {
  std::map<std::string, std::string> attributes = {{"covary:estimator", make_estimator(o.estimator).text},
                                                   {"covary:version", COVARY_VERSION},
                                                   {"covary:command", command_line()}};
  if (crn.samples() && independent.samples())
    attributes["covary:samples"] = fmt::to_string(crn.samples() + independent.samples());
  std::map<std::string, Image> no_aovs;
  write_result(o.output, crn.place(), attributes, result, no_aovs);
}

void check_explain(const CombineOptions& o, const Estimator& estimator, const GroupedFile& file) {
  if (o.explain.empty()) return;
  const CropWindow& window = file.place().window;
  const int x = o.explain[0] - window.x, y = o.explain[1] - window.y;
  if (estimator.reads_guides)
    throw Error(ErrorCode::kUsage, "--explain: with --denoise, a pixel is no sum of control variates");
  if (!estimator.explain)
    throw Error(ErrorCode::kUsage, "--explain: " + o.estimator.name + " has no control variates with coefficients");
  if (x < 0 || y < 0 || x >= window.width || y >= window.height)
    throw Error(ErrorCode::kUsage,
                fmt::format("--explain {},{} is outside the image: {} x {} pixels at ({}, {})", o.explain[0],
                            o.explain[1], window.width, window.height, window.x, window.y));
}

/// What one pixel is made of: f, and for each control variate its place, coefficients, CRN mean and independent mean.
nlohmann::ordered_json explain(const CombineOptions& o, const Estimator& estimator, const GroupedFile& crn,
                               Bands& bands) {
  const CropWindow& window = crn.place().window;
  const int x = o.explain[0] - window.x, y = o.explain[1] - window.y;
  const int first = bands.read_around(y, y + 1, estimator.reach);
  const auto mean = [&](const GroupedImage& image, int px, int py) {
    const uint32_t count = image.count(px, py);
    return mean_of_groups({1, 1, image.groups, image.pixel(px, py), &count}).estimate.data;
  };
  const GroupedImage g = bands.crn(), h = bands.independent();
  nlohmann::ordered_json variates = nlohmann::ordered_json::array();
  for (const ControlVariate& v : estimator.explain(g, h, x, y - first))
    variates.push_back({{"dx", v.dx},
                        {"dy", v.dy},
                        {"beta", v.beta},
                        {"crn", mean(g, x + v.dx, y - first + v.dy)},
                        {"independent", mean(h, x + v.dx, y - first + v.dy)}});
  return {{"x", o.explain[0]},
          {"y", o.explain[1]},
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

/// The layers of --guides.
struct GuideImages {
  std::optional<Image> albedo, normal;
  Guides view() const { return {albedo ? &*albedo : nullptr, albedo && normal ? &*normal : nullptr}; }
};

GuideImages read_guides(const CombineOptions& o, const Estimator& estimator, const GroupedFile& file) {
  if (o.guides.empty()) return {};
  if (!estimator.reads_guides)
    throw Error(ErrorCode::kUsage, "--guides is an option of --denoise bias, balanced and error");
  const ImageInfo info = inspect_image(o.guides);
  GuideImages guides{guide_layer(o.guides, info, "Albedo"), guide_layer(o.guides, info, "N")};
  if (!guides.albedo)
    throw Error(ErrorCode::kInput,
                fmt::format("--guides '{}' has no layer Albedo (Albedo.R, .G, .B), and may have a layer N", o.guides));
  for (const auto& guide : {guides.albedo, guides.normal})
    if (guide && (guide->width != file.width() || guide->height != file.height()))
      throw Error(ErrorCode::kInput, fmt::format("--guides '{}' has {} x {} pixels, the images have {} x {}", o.guides,
                                                 guide->width, guide->height, file.width(), file.height()));
  return guides;
}

/// A file used twice would be a control variate of itself, or a group without information of its own.
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
  for (const std::string& path : {o.light, o.counts, o.guides})
    if (!path.empty()) outputs.reads(path);
  outputs.writes("-o", o.output, OutputKind::kFilm);
  outputs.writes("--json", o.json, OutputKind::kText);
}

void combine(const CombineOptions& o) {
  check_files_of_command(o);
  std::optional<tbb::global_control> control;
  if (o.threads > 0) control.emplace(tbb::global_control::max_allowed_parallelism, o.threads);
  Stopwatch watch;
  ProgressLine progress(std::filesystem::path(o.output).stem().string(), o.quiet);
  progress.begin("loading and checking");
  GroupedFile crn(o.crn, o.crn_layer), independent(o.independent, o.independent_layer);
  std::optional<GroupedFile> light;
  if (!o.light.empty()) light.emplace(std::vector{o.light});
  const Estimator estimator = make_estimator(o.estimator);
  PairSettings settings = pair_settings(
      estimator, estimator.needs_sample_count || o.counts.empty() ? o.samples : std::nullopt, crn.samples(), o.error);
  const GuideImages guides = read_guides(o, estimator, crn);
  settings.guides = guides.view();
  check_explain(o, estimator, crn);
  check_stages(o.stages, estimator);
  take_counts(o.counts, o.samples, crn, independent);

  std::vector<Finding> findings;
  const ImageOrigin crn_origin = origin_of(crn), independent_origin = origin_of(independent);
  const std::optional<ImageOrigin> light_origin = light ? std::optional(origin_of(*light)) : std::nullopt;
  check_origins(crn_origin, independent_origin, findings);
  check_light(crn_origin, independent_origin, light_origin ? &*light_origin : nullptr, findings);
  Bands bands(crn, independent, o.memory_mib);
  const InputReport report = examine(estimator, crn, independent, bands);
  findings.insert(findings.end(), report.findings.begin(), report.findings.end());
  if (const std::string errors = errors_text(findings); !errors.empty() && !o.force)
    throw Error(ErrorCode::kInput, "the inputs do not fit: " + errors + " (--force combines them nevertheless)");
  progress.clear();
  for (const Finding& f : findings) {
    const bool note = f.severity == Finding::Severity::kNote;
    if (!note || !o.quiet) std::fprintf(stderr, "%s: %s\n", note ? "note" : "warning", f.text.c_str());
  }
  const double check_seconds = watch.lap();

  progress.begin(o.estimator.denoise == "none" ? "estimating" : "estimating and denoising");
  EstimatorResult result = estimate(estimator, settings, crn, bands);
  calibrate(result);
  if (light) add_light_file(*light, result);
  const double estimate_seconds = watch.lap();
  progress.begin("writing");
  write(o, crn, independent, result);
  if (!o.stages.empty()) {
    bands.read(0, crn.height());
    save_stages(o.stages, estimator, bands.crn(), bands.independent(), settings, crn.place());
  }
  const double write_seconds = watch.lap();
  progress.finish();
  nlohmann::ordered_json pixel;
  if (!o.explain.empty()) {
    pixel = explain(o, estimator, crn, bands);
    if (o.json != "-") print_explanation(pixel);
  }

  if (!o.quiet)
    std::fprintf(stderr, "%s: %d x %d, %s of %d + %d groups in %.2f s (read and check %.2f s, write %.2f s)\n",
                 o.output.c_str(), crn.width(), crn.height(), o.estimator.name.c_str(), crn.groups(),
                 independent.groups(), estimate_seconds, check_seconds, write_seconds);
  if (o.json.empty()) return;
  nlohmann::ordered_json json = {
      {"output", o.output},
      {"estimator", estimator.text},
      {"width", crn.width()},
      {"height", crn.height()},
      {"crn_groups", crn.groups()},
      {"independent_groups", independent.groups()},
      {"nonfinite_pixels", result.nonfinite_pixels},
      {"negative_pixels", count_negative_pixels(result.estimate)},
      {"rank_correlation",
       {{"crn_horizontal", json_of(report.crn_horizontal)},
        {"crn_vertical", json_of(report.crn_vertical)},
        {"independent_horizontal", json_of(report.independent_horizontal)},
        {"independent_vertical", json_of(report.independent_vertical)},
        {"crn_independent", json_of(report.crn_independent)}}},
      {"mean", {{"crn", report.crn_mean}, {"independent", report.independent_mean}}},
      {"seconds", {{"read_and_check", check_seconds}, {"estimate", estimate_seconds}, {"write", write_seconds}}}};
  if (light) json["light_groups"] = light->groups();
  if (!pixel.is_null()) json["pixel"] = pixel;
  write_text_output(o.json, json_text(json));
}

}  // namespace

void add_combine(CLI::App& app) {
  const auto o = std::make_shared<CombineOptions>();
  CLI::App* command =
      app.add_subcommand("combine", "Combine a CRN and an independent image of any renderer into one with less noise");
  command->add_option("--crn", o->crn, "Image with common random numbers: one EXR with all groups, or one per group")
      ->required()
      ->expected(1, 1000);
  command->add_option("--independent,--pt", o->independent, "Image with independent random numbers, likewise")
      ->required()
      ->expected(1, 1000);
  command->add_option("-o,--output", o->output, "The result (EXR)")->required();
  command->add_option("--crn-layer", o->crn_layer, "Layer of the CRN image where its files hold several");
  command->add_option("--independent-layer,--pt-layer", o->independent_layer,
                      "Layer of the independent image where its files hold several");
  command->add_option("--counts", o->counts,
                      "EXR with the samples of each pixel of the independent image, all groups together, where its "
                      "files do not tell and pixels differ");
  command->add_option("--light", o->light, "Light film (light.exr of covary render --passes) to add to the result");
  command->add_option("--estimator", o->estimator.name, "iicv, or a comparator")
      ->check(CLI::Validator([](std::string& name) { return needs_samples_text(name); }, ""))
      ->check(one_of(pair_estimator_names()))
      ->capture_default_str();
  add_estimator_options(*command, o->estimator, pair_estimator_names(), kAdaptiveOptions);
  add_denoise_options(*command, o->estimator);
  command->add_option("--guides", o->guides,
                      "For --denoise: image (EXR) of the same pixels whose layers Albedo and N show the surfaces");
  add_stages_option(*command, o->stages);
  command
      ->add_option("--samples", o->samples,
                   fmt::format("With --counts, or {}: samples per pixel of the CRN image; default: what its file tells",
                               fmt::join(estimators_with_samples(), ", ")))
      ->transform(whole_number(1, std::numeric_limits<int>::max()));
  command->add_flag("--error", o->error, "Add the standard error as channels StdError.R, .G, .B");
  command->add_option("--explain", o->explain, "X,Y: print the control variates of this pixel and their coefficients")
      ->delimiter(',')
      ->expected(2)
      ->transform(whole_number(0, std::numeric_limits<int>::max()))
      ->type_name("X,Y");
  command->add_flag("--force", o->force, "Combine even where the check of the inputs finds errors");
  command
      ->add_option("--memory", o->memory_mib,
                   "MiB to work in: larger images are worked on in bands, with the same bits")
      ->check(positive_number())
      ->capture_default_str();
  add_threads_option(*command, o->threads);
  command->add_option("--json", o->json, "File for statistics; '-': standard output");
  command->add_flag("--quiet", o->quiet, "Warnings and errors only");
  command->callback([o] { combine(*o); });
}

}  // namespace covary
