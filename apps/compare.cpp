// SPDX-License-Identifier: Apache-2.0
// covary compare: errors of images against one reference, or two independent ones.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <vector>

#include "commands.h"
#include "compare_frames.h"
#include "comparison_warnings.h"
#include "core/printable.h"
#include "declared_options.h"
#include "denoising/denoised_references.h"
#include "film/image_rows.h"
#include "film/image_writer.h"
#include "film/outputs.h"
#include "json_output.h"
#include "metrics/alignment.h"
#include "metrics/compared_rows.h"
#include "metrics/error_map.h"
#include "metrics/flip.h"
#include "metrics/metrics.h"
#include "numbers.h"
#include "picture_options.h"
#include "usage_error.h"
#include "value_names.h"

namespace covary {
namespace {

/// One image's errors, in the order of the requested metrics.
struct Comparison {
  CropWindow window, of_image;  ///< compared; of the image
  std::vector<MetricResult> results;
  double mean() const { return results[0].mean; }
  double reference_mean() const { return results[0].reference_mean; }
};

/// Checks that the bands of rows, and the map if requested, fit in memory.
void require_memory_to_compare(const CompareOptions& options, const std::string& path, const ComparedRows& rows,
                               size_t n_images) {
  constexpr double kImage = 3 * sizeof(float), kFlip = 120;  // metrics/flip.cpp
  const auto is_flip = [](const std::string& name) { return name == "flip"; };
  const bool flip = std::any_of(options.metrics.begin(), options.metrics.end(), is_flip);
  const int band = std::min(rows.band_rows() + (flip ? 2 * kFlipHalo : 0), rows.height());
  require_image_memory(path, rows.width(), band, 2 * kImage * static_cast<double>(n_images) + (flip ? kFlip : 1));
  if (!options.error_map.empty()) require_image_memory(path, rows.width(), rows.height(), sizeof(float) + kImage);
}

/// What relative errors against two references are relative to: the named image, or the denoised references.
std::vector<Image> denominators_of(const CompareOptions& options, std::vector<ImageRows>& references,
                                   const std::string& path, const ImagePlace& place, const CropWindow& window) {
  if (references.size() < 2 || !has_relative_metric(options)) return {};
  const double image = 3 * sizeof(float);
  require_image_memory(path, window.width, window.height, 2 * image + kBytesOfDenoisedReferences);
  const auto pixels = [&](ImageRows& file) { return cut({file.place(), file.read_all()}, window); };
  if (!options.denominator.empty()) {
    ImageRows file(options.denominator, chosen_layer(options.denominator, options.choice));
    file.convert_to(references[0].colours());
    if (!(common_window(path, place, window, options.denominator, file.place()) == window))
      throw Error(ErrorCode::kInput,
                  fmt::format("--denominator '{}' does not cover {}", options.denominator, text_of(window)));
    return {pixels(file)};
  }
  return denoised_references(std::vector{pixels(references[0]), pixels(references[1])});
}

Comparison compare_one(const CompareOptions& options, std::vector<ImageRows>& references, const std::string& path) {
  ImageRows image(path, chosen_layer(path, options.choice));
  Comparison comparison;
  comparison.of_image = image.place().window;
  comparison.window =
      common_window(path, image.place(), image.place().window, options.reference, references[0].place());
  bool low_dynamic_range = image.low_dynamic_range() && references[0].low_dynamic_range();
  if (references.size() == 2) {
    comparison.window =
        common_window(path, image.place(), comparison.window, options.reference2, references[1].place());
    low_dynamic_range = low_dynamic_range && references[1].low_dynamic_range();
  }
  std::vector<ImageRows*> files{&image};
  for (ImageRows& reference : references) files.push_back(&reference);
  require_memory_to_compare(options, path, ComparedFiles(files, comparison.window), files.size());
  for (ImageRows* file : files) file->convert_to(references[0].colours());
  const std::vector<Image> denominators = denominators_of(options, references, path, image.place(), comparison.window);
  for (const std::string& name : options.metrics) {
    const bool with_map = comparison.results.empty() && !options.error_map.empty();
    // Relative errors are those of the reference's colours; FLIP is about what a display shows.
    const bool is_shown = find_metric(name).metric == Metric::kFlip;
    const ColourSpace colours = is_shown ? ColourSpace::rec709() : references[0].colours();
    try {
      for (ImageRows* file : files) file->convert_to(colours);
      ComparedFiles rows(files, comparison.window);
      rows.set_denominators(denominators);
      comparison.results.push_back(compute_metric(find_metric(name).metric, rows, low_dynamic_range, with_map));
    } catch (const Error& error) {
      const std::string text = error.what();
      const bool names_file = text.starts_with(path) || text.starts_with(options.reference) ||
                              (!options.reference2.empty() && text.starts_with(options.reference2));
      throw Error(error.code(), names_file ? text : path + ": " + text);
    }
  }
  return comparison;
}

nlohmann::ordered_json json_of(const CompareOptions& options, const std::string& path, const Comparison& c,
                               const std::vector<std::string>& warnings) {
  nlohmann::ordered_json object{{"image", path}, {"reference", options.reference}};
  if (!options.reference2.empty()) object["reference2"] = options.reference2;
  object["window"] = {c.window.x, c.window.y, c.window.width, c.window.height};
  object["pixels"] = c.results[0].n_pixels;
  object["non_finite_pixels"] = c.results[0].n_non_finite;
  if (!options.choice.view.empty()) object["view"] = options.choice.view;
  object["mean"] = c.mean();
  object["reference_mean"] = c.reference_mean();
  for (size_t m = 0; m < options.metrics.size(); ++m) {
    object[options.metrics[m]] = c.results[m].value;
    if (c.results[m].reference_error > 0)
      object[options.metrics[m] + "_reference_error"] = c.results[m].reference_error;
  }
  object["warnings"] = warnings;
  return object;
}

/// Of errors that the references' noise makes uncertain.
std::vector<std::string> noise_warnings(const CompareOptions& options, const std::string& path, const Comparison& c) {
  std::vector<std::string> warnings;
  for (size_t m = 0; m < options.metrics.size(); ++m)
    if (const MetricResult& r = c.results[m]; r.reference_error > kMaxReferenceNoise * std::abs(r.value))
      warnings.push_back(
          fmt::format("{}: the noise of the references makes the {} of {:.3g} uncertain by ±{:.2g}; "
                      "references with more samples would tell more",
                      path, options.metrics[m], r.value, r.reference_error));
  return warnings;
}

std::string ratio_text(double mean, double reference_mean) {
  const double ratio = mean / reference_mean;
  if (!std::isfinite(ratio)) return "-";
  return std::abs(ratio) < 1e6 ? fmt::format("{:.6f}", ratio) : fmt::format("{:.6g}", ratio);
}

void print_table(const CompareOptions& options, const std::vector<Comparison>& comparisons) {
  size_t width = 5;
  for (const std::string& path : options.images) width = std::max(width, path.size());
  for (const std::string& name : options.metrics) {
    const MetricInfo& info = find_metric(name);
    fmt::print("{} = {}\n", name, formula_text(options, info));
  }
  fmt::print("{:{}}", "image", width);
  for (const std::string& name : options.metrics) fmt::print("  {:>12}", name);
  fmt::print("  {:>10}\n", "mean/ref.");
  for (size_t i = 0; i < comparisons.size(); ++i) {
    fmt::print("{:{}}", options.images[i], width);
    for (const MetricResult& result : comparisons[i].results) fmt::print("  {:12.6g}", result.value);
    fmt::print("  {:>10}\n", ratio_text(comparisons[i].mean(), comparisons[i].reference_mean()));
  }
}

/// E.png for one image; E-<name>.png for several, with a number if names repeat.
std::vector<std::string> map_paths(const CompareOptions& options) {
  if (options.images.size() == 1) return {options.error_map};
  const std::filesystem::path path(options.error_map);
  std::vector<std::string> result;
  for (const std::string& image : options.images) {
    const auto named = [&](const std::string& suffix) {
      const std::string stem = std::filesystem::path(image).stem().string();
      const std::string file = fmt::format("{}-{}{}{}", path.stem().string(), stem, suffix, path.extension().string());
      return (path.parent_path() / file).string();
    };
    std::string name = named("");
    for (int n = 2; std::find(result.begin(), result.end(), name) != result.end(); ++n)
      name = named(fmt::format("-{}", n));
    result.push_back(name);
  }
  return result;
}

/// One map per image, of the first metric, all on the same scale.
void write_error_maps(const CompareOptions& options, const std::vector<Comparison>& comparisons) {
  std::vector<Image> maps;
  for (const Comparison& c : comparisons) maps.push_back(c.results[0].map);
  ErrorScale scale;
  if (!options.error_range.empty())
    scale = {options.error_range[0], options.error_range[1], options.metrics[0] != "flip"};
  else if (options.metrics[0] != "flip")
    scale = decade_scale(maps);
  const std::vector<std::string> paths = map_paths(options);
  for (size_t i = 0; i < maps.size(); ++i) {
    write_png(paths[i], colour_errors(maps[i], scale));
    fmt::print(stderr, "{}: {} of {}, {}\n", paths[i], options.metrics[0], options.images[i], scale.legend());
  }
}

void check_options(const CompareOptions& options) {
  for (const std::string& name : options.metrics) {
    find_metric(name);
    if (std::count(options.metrics.begin(), options.metrics.end(), name) > 1)
      usage("--metric names '" + name + "' more than once");
  }
  if (!options.denominator.empty() && (options.reference2.empty() || !has_relative_metric(options)))
    usage("--denominator is an option of relmse and relmse-trimmed with --reference2");
  if (options.overwrite && options.error_map.empty()) usage("--overwrite needs --error-map");
  if (!options.error_range.empty()) {
    if (options.error_map.empty()) usage("--error-range needs --error-map");
    const bool positive = options.metrics[0] == "flip" || options.error_range[0] > 0;
    if (!positive || !(options.error_range[0] < options.error_range[1]))
      usage(fmt::format("--error-range {},{}: expected two rising positive numbers", options.error_range[0],
                        options.error_range[1]));
  }
}

void check_files(const CompareOptions& options) {
  Outputs outputs;
  // Checked first, because "--json a.exr" would take the image for the JSON file.
  if (options.json) outputs.writes("--json", *options.json, OutputKind::kText);
  outputs.reads(options.images);
  outputs.reads(options.reference);
  for (const std::string& path : {options.reference2, options.denominator})
    if (!path.empty()) outputs.reads(path);
  if (options.error_map.empty()) return;
  for (const std::string& path : map_paths(options))
    outputs.writes_result("--error-map", path, OutputKind::kPng, "compare", options.overwrite);
}

/// Compares one view of the files; returns the JSON, if requested. `printed`: warnings of other views.
std::string compare_view(const CompareOptions& options, std::set<std::string>& printed) {
  std::vector<ImageRows> references;
  for (const std::string& path : {options.reference, options.reference2})
    if (!path.empty()) references.emplace_back(path, chosen_layer(path, options.choice));

  std::vector<Comparison> comparisons;
  for (const std::string& path : options.images) {
    comparisons.push_back(compare_one(options, references, path));
    const Comparison& c = comparisons.back();
    if (c.results[0].n_non_finite)
      fmt::print(stderr, "covary: {}: {} of {} pixels are not finite here or in the reference and are left out\n", path,
                 c.results[0].n_non_finite, c.results[0].n_non_finite + c.results[0].n_pixels);
    if (!(c.window == references[0].place().window) || !(c.window == c.of_image))
      fmt::print(stderr, "covary: {}: compared over the pixels in common, {}\n", path, text_of(c.window));
  }

  std::vector<std::vector<std::string>> warnings = warn_of_comparison(
      options.images,
      options.reference2.empty() ? std::vector{options.reference} : std::vector{options.reference, options.reference2},
      printed);
  for (size_t i = 0; i < comparisons.size(); ++i)
    for (const std::string& text : noise_warnings(options, options.images[i], comparisons[i]))
      fmt::print(stderr, "warning: {}\n", text), warnings[i].push_back(text);
  const bool json_to_output = options.json && (options.json->empty() || *options.json == "-");
  std::string json;
  if (options.json)
    for (size_t i = 0; i < comparisons.size(); ++i)
      json += json_text(json_of(options, options.images[i], comparisons[i], warnings[i]), -1);
  if (!json_to_output) print_table(options, comparisons);
  if (!options.error_map.empty()) write_error_maps(options, comparisons);
  return json;
}

void compare(const CompareOptions& options) {
  check_options(options);
  if (compares_frames(options)) return compare_frames(options);
  check_files(options);
  const std::vector<PictureChoice> views = each_view(options.reference, options.choice);
  if (views.size() > 1 && !options.error_map.empty())
    throw Error(ErrorCode::kUsage, "--error-map is an option of one view; name it by --view");
  const bool json_to_output = options.json && (options.json->empty() || *options.json == "-");
  std::string json;
  std::set<std::string> printed;
  for (const PictureChoice& view : views) {
    CompareOptions one = options;
    one.choice = view;
    if (views.size() > 1 && !json_to_output)
      fmt::print("view {}\n", printable(view.view.empty() ? view.layer : view.view));
    json += compare_view(one, printed);
  }
  if (options.json) write_text_output(*options.json, json);
}

}  // namespace

void add_compare(CLI::App& app) {
  const auto o = std::make_shared<CompareOptions>();
  CLI::App* command = app.add_subcommand("compare", "Errors of images against a reference");
  add_value(*command, "IMAGES", o->images, kFileValue,
            "Images (EXR, PNG, HDR, PFM, …), or frames (out_####.exr), whose changes are compared, too")
      ->required();
  add_value(*command, "-r,--reference", o->reference, kFileValue, "The reference image, or ref_####.exr")->required();
  add_value(*command, "--reference2", o->reference2, kFileValue,
            "A second, independent reference: products (F - R1)(F - R2) cancel the references' noise");
  add_value(*command, "--denominator", o->denominator, kFileValue,
            "With two references: an image with little noise that relmse and relmse-trimmed are relative to; default: "
            "the denoised references");
  add_value(*command, "-m,--metric", o->metrics, "METRIC",
            "relmse, relmse-trimmed, mse, mae, mape, flip, above5; several separated by commas")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->capture_default_str();
  add_picture_options(*command, o->choice, "Compare", "default: the picture");
  command
      ->add_option("--json", o->json, "One JSON object per image and line; to standard output without FILE or with -")
      ->expected(0, 1)
      ->type_name("[FILE]");
  add_value(*command, "--error-map", o->error_map, kFileValue,
            "PNG of the first metric's error per pixel; its scale is printed");
  command->add_option("--error-range", o->error_range, "LOW,HIGH: ends of the error map's scale")
      ->delimiter(',')
      ->expected(2)
      ->check(finite_number());
  add_overwrite_option(*command, o->overwrite);
  add_value(*command, "--frames", o->frames, "FIRST-LAST", "Only these frames of out_####.exr; default: all");
  add_value(*command, "--baseline", o->baseline, kFileValue,
            "A sequence (…_####.exr) that a second table is relative to, with the worst region of 32 x 32 pixels");
  command->callback([o] { compare(*o); });
}

}  // namespace covary
