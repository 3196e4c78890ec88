// SPDX-License-Identifier: Apache-2.0
#include "compare_frames.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "comparison_warnings.h"
#include "core/error.h"
#include "denoising/denoised_references.h"
#include "film/image_file.h"
#include "film/outputs.h"
#include "frame_files.h"
#include "json_output.h"
#include "metrics/alignment.h"
#include "metrics/metrics.h"
#include "metrics/sequence_errors.h"
#include "picture_options.h"
#include "sequences/frame_names.h"
#include "usage_error.h"

namespace covary {
namespace {

using Json = nlohmann::ordered_json;

/// Errors of one sequence, frame by frame.
struct ComparedSequence {
  std::string pattern;
  std::vector<std::vector<double>> metrics;  ///< of each frame, in the order requested
  SequenceErrors errors;
  SequenceSummary summary() const { return summary_of(errors.frames()); }
  std::vector<double> mean_metrics() const {
    std::vector<double> means(metrics[0].size());
    for (const std::vector<double>& of_frame : metrics)
      for (size_t m = 0; m < means.size(); ++m) means[m] += of_frame[m] / static_cast<double>(metrics.size());
    return means;
  }
};

std::vector<std::string> references_of(const CompareOptions& o, int frame) {
  std::vector<std::string> paths{file_of_frame(o.reference, frame)};
  if (!o.reference2.empty()) paths.push_back(file_of_frame(o.reference2, frame));
  return paths;
}

/// --denominator, or the denoised references.
std::vector<Image> denominators_of(const CompareOptions& o, int frame, const std::string& path, const ImagePlace& place,
                                   const CropWindow& window, const std::vector<Image>& references) {
  if (o.denominator.empty()) return denoised_references(references);
  const std::string file = file_of_frame(o.denominator, frame);
  PlacedImage image = read_image(file, chosen_layer(file, o.choice));
  if (!(common_window(path, place, window, file, image.place) == window))
    throw Error(ErrorCode::kInput, fmt::format("--denominator '{}' does not cover {}", file, text_of(window)));
  return {cut(std::move(image), window)};
}

ComparedSequence compare_sequence(const CompareOptions& o, const std::string& pattern, const std::vector<int>& frames) {
  ComparedSequence sequence{pattern, {}, {}};
  for (const int frame : frames) {
    const std::string path = frame_name(pattern, frame);
    const std::vector<std::string> reference_paths = references_of(o, frame);
    const ImagePlace place = inspect_image(path).place;
    constexpr double kImages = 12 * 3 * sizeof(float),
                     kFlip = 2 * 120;  // two frames and their references; metrics/flip.cpp
    require_image_memory(path, place.window.width, place.window.height, kImages + kFlip);
    PlacedImage image = read_image(path, chosen_layer(path, o.choice));
    std::vector<PlacedImage> sources;
    CropWindow window = image.place.window;
    for (const std::string& reference : reference_paths) {
      sources.push_back(read_image(reference, chosen_layer(reference, o.choice)));
      window = common_window(path, image.place, window, reference, sources.back().place);
    }
    const bool low = image.low_dynamic_range && sources[0].low_dynamic_range && sources.back().low_dynamic_range;
    std::vector<Image> references;
    for (PlacedImage& source : sources) references.push_back(cut(std::move(source), window));
    Image pixels = cut(std::move(image), window);
    std::vector<Image> denominators;
    if (references.size() == 2) denominators = denominators_of(o, frame, path, place, window, references);
    sequence.metrics.emplace_back();
    for (const std::string& name : o.metrics)
      sequence.metrics.back().push_back(
          compute_metric(find_metric(name).metric, pixels, references, low, denominators).value);
    sequence.errors.add(std::move(pixels), std::move(references), low, std::move(denominators));
    if (const uint64_t n = sequence.errors.frames().back().n_non_finite)
      fmt::print(stderr, "covary: {}: {} pixels are not finite here or in the reference and are left out\n", path, n);
  }
  return sequence;
}

Json number(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json json_of(const WorstRegion& worst, const std::vector<int>& frames) {
  Json json{{"ratio", number(worst.ratio)}, {"column", worst.column}, {"row", worst.row}};
  if (worst.frame >= 0) json["frame"] = frames[static_cast<size_t>(worst.frame)];
  json["left_out"] = worst.left_out;
  return json;
}

Json json_of(const CompareOptions& o, const ComparedSequence& s, const ComparedSequence* baseline,
             const std::vector<int>& frames, const std::vector<std::string>& warnings) {
  Json json{{"image", s.pattern}, {"reference", o.reference}};
  if (!o.reference2.empty()) json["reference2"] = o.reference2;
  const auto add = [&](Json& object, const std::vector<double>& metrics, const auto& errors) {
    for (size_t m = 0; m < metrics.size(); ++m) object[o.metrics[m]] = metrics[m];
    object["temporal"] = number(errors.temporal);
    object["temporal_flip"] = number(errors.temporal_flip);
    object["still_relmse"] = number(errors.still_relmse);
    object["still_part"] = errors.still_part;
  };
  add(json, s.mean_metrics(), s.summary());
  json["frames"] = Json::array();
  for (size_t f = 0; f < frames.size(); ++f) {
    Json object{{"frame", frames[f]}};
    add(object, s.metrics[f], s.errors.frames()[f]);
    object["non_finite_pixels"] = s.errors.frames()[f].n_non_finite;
    json["frames"].push_back(object);
  }
  if (baseline) {
    const WorstRegions worst = worst_regions(s.errors.frames(), baseline->errors.frames());
    json["baseline"] = baseline->pattern;
    json["worst_region"] = {{"relmse", json_of(worst.relmse, frames)},
                            {"relmse_of_frame", json_of(worst.relmse_of_frame, frames)},
                            {"temporal", json_of(worst.temporal, frames)},
                            {"temporal_of_frame", json_of(worst.temporal_of_frame, frames)}};
  }
  json["warnings"] = warnings;
  return json;
}

/// A row of a table; unknown values are left empty.
void print_row(const std::string& name, size_t width, const std::vector<double>& values) {
  fmt::print("{:{}}", name, width);
  for (const double value : values) fmt::print("  {:>13}", std::isfinite(value) ? fmt::format("{:.6g}", value) : "-");
  fmt::print("\n");
}

void print_header(const std::string& name, size_t width, const std::vector<std::string>& columns) {
  fmt::print("{:{}}", name, width);
  for (const std::string& column : columns) fmt::print("  {:>13}", column);
  fmt::print("\n");
}

/// Whether the error where nothing changes is known of any sequence.
bool have_still(const std::vector<ComparedSequence>& sequences) {
  return std::ranges::any_of(sequences, [](const auto& s) { return std::isfinite(s.summary().still_relmse); });
}

void print_errors(const CompareOptions& o, const std::vector<ComparedSequence>& sequences,
                  const std::vector<int>& frames, size_t width) {
  for (const std::string& name : o.metrics) {
    const MetricInfo& info = find_metric(name);
    fmt::print("{} = {}\n", name, formula_text(o, info));
  }
  const bool is_still = have_still(sequences);
  fmt::print(
      "temporal = relmse of changes since the frame before\n"
      "temporal-flip = 1/N sum |FLIP of both frames - FLIP of both references|\n{}\n",
      is_still ? "still = relmse where the references do not change" : "the references change everywhere");
  std::vector<std::string> columns = o.metrics;
  columns.insert(columns.end(), {"temporal", "temporal-flip"});
  if (is_still) columns.emplace_back("still");
  print_header("image", width, columns);
  const auto row = [&](const std::string& name, std::vector<double> values, const auto& errors) {
    values.insert(values.end(), {errors.temporal, errors.temporal_flip});
    if (is_still) values.push_back(errors.still_relmse);
    print_row(name, width, values);
  };
  for (const ComparedSequence& s : sequences) {
    for (size_t f = 0; f < frames.size(); ++f)
      row(frame_name(s.pattern, frames[f]), s.metrics[f], s.errors.frames()[f]);
    row(s.pattern, s.mean_metrics(), s.summary());
  }
}

void print_multiples(const std::vector<ComparedSequence>& sequences, const ComparedSequence& baseline, size_t width) {
  fmt::print(
      "\nmultiples of the errors of {}; worst: the largest of any region of {} x {} pixels, of means over frames and "
      "of "
      "single frames\n",
      baseline.pattern, kRegionSide, kRegionSide);
  print_header("image", width,
               {"relmse", "temporal", "temporal-flip", "still", "worst relmse", "temporal", "of a frame", "temporal"});
  const SequenceSummary base = baseline.summary();
  for (const ComparedSequence& s : sequences) {
    const SequenceSummary own = s.summary();
    const WorstRegions worst = worst_regions(s.errors.frames(), baseline.errors.frames());
    print_row(s.pattern, width,
              {own.relmse / base.relmse, own.temporal / base.temporal, own.temporal_flip / base.temporal_flip,
               own.still_relmse / base.still_relmse, worst.relmse.ratio, worst.temporal.ratio,
               worst.relmse_of_frame.ratio, worst.temporal_of_frame.ratio});
  }
}

/// Of the first frame of each sequence.
std::vector<std::vector<std::string>> warnings_of(const CompareOptions& o, int frame) {
  std::vector<std::string> files;
  for (const std::string& pattern : o.images) files.push_back(frame_name(pattern, frame));
  std::set<std::string> printed;
  return warn_of_comparison(files, references_of(o, frame), printed);
}

}  // namespace

bool has_relative_metric(const CompareOptions& o) {
  return std::any_of(o.metrics.begin(), o.metrics.end(), [](const std::string& name) {
    const Metric metric = find_metric(name).metric;
    return metric == Metric::kRelMse || metric == Metric::kRelMseTrimmed;
  });
}

std::string formula_text(const CompareOptions& o, const MetricInfo& metric) {
  if (o.reference2.empty()) return metric.formula;
  std::string text = metric.formula_two;
  const std::string denoised = "denoised references";
  if (const size_t at = text.find("the " + denoised); !o.denominator.empty() && at != std::string::npos)
    text.replace(at, 4 + denoised.size(), o.denominator);
  else if (const size_t short_at = text.find(denoised); !o.denominator.empty() && short_at != std::string::npos)
    text.replace(short_at, denoised.size(), o.denominator);
  return text;
}

bool compares_frames(const CompareOptions& o) {
  const bool of_frames = is_frame_pattern_of_input(o.images[0]);
  for (const std::string& path : o.images)
    if (is_frame_pattern_of_input(path) != of_frames)
      usage(fmt::format("'{}' and '{}': either all images are names with '#', or none", o.images[0], path));
  if (!of_frames && !(o.frames + o.baseline).empty())
    usage("--frames and --baseline need frames, whose names have a '#' for the number");
  if (of_frames && o.choice.view == "all") usage("--view all is for single images; name one view of frames");
  if (of_frames && !o.error_map.empty()) usage("--error-map is an option of single images, not of frames");
  if (!o.baseline.empty() && !is_frame_pattern_of_input(o.baseline))
    usage(fmt::format("--baseline '{}' has no '#' for the frame number", o.baseline));
  return of_frames;
}

void compare_frames(const CompareOptions& o) {
  const std::vector<int> frames = frames_of(o.frames, o.images[0]);
  Outputs outputs;
  if (o.json) outputs.writes("--json", *o.json, OutputKind::kText);
  for (const int frame : frames) {
    for (const std::string& pattern : o.images) outputs.reads(frame_name(pattern, frame));
    if (!o.baseline.empty()) outputs.reads(frame_name(o.baseline, frame));
    for (const std::string& path : references_of(o, frame)) outputs.reads(path);
    if (!o.denominator.empty()) outputs.reads(file_of_frame(o.denominator, frame));
  }
  std::vector<ComparedSequence> sequences;
  for (const std::string& pattern : o.images) sequences.push_back(compare_sequence(o, pattern, frames));
  std::optional<ComparedSequence> baseline;
  if (!o.baseline.empty()) baseline = compare_sequence(o, o.baseline, frames);

  std::string json;
  size_t width = 5;
  const std::vector<std::vector<std::string>> warnings = warnings_of(o, frames[0]);
  for (size_t i = 0; i < sequences.size(); ++i) {
    const ComparedSequence& s = sequences[i];
    if (o.json) json += json_text(json_of(o, s, baseline ? &*baseline : nullptr, frames, warnings[i]), -1);
    width = std::max({width, s.pattern.size(), frame_name(s.pattern, frames.back()).size()});
  }
  if (!o.json || !(o.json->empty() || *o.json == "-")) {
    print_errors(o, sequences, frames, width);
    if (baseline) print_multiples(sequences, *baseline, width);
  }
  if (o.json) write_text_output(*o.json, json);
}

}  // namespace covary
