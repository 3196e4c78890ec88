// SPDX-License-Identifier: Apache-2.0
#include "lab/measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "core/content_hash.h"
#include "core/error.h"
#include "core/parallel.h"
#include "film/film_file.h"
#include "film/image_file.h"
#include "lab/cell_pairs.h"
#include "lab/scene_images.h"
#include "metrics/metrics.h"

namespace covary::lab {
namespace {

/// Errors of a run's image that are cached; recomputing the others is cheaper than reading them.
constexpr std::pair<const char*, double RunResult::*> kKept[] = {
    {"relmse_trimmed", &RunResult::relmse_trimmed},
    {"mae", &RunResult::mae},
    {"flip", &RunResult::flip},
    {"above5", &RunResult::above5},
    {"predicted_relmse", &RunResult::predicted_relmse},
    {"coverage", &RunResult::coverage},
    {"predicted_relmse_low", &RunResult::predicted_low},
    {"predicted_relmse_high", &RunResult::predicted_high},
};

/// The standard errors in the file; empty if there are none, or if another layer is measured.
Image standard_errors(const std::string& path, const SceneInstance& scene) {
  const ImageInfo info = inspect_image(files_of(scene.frames, path).front());
  const bool has_errors = std::any_of(info.channels.begin(), info.channels.end(),
                                      [](const ExrFile::Channel& c) { return c.name == "StdError.R"; });
  return has_errors && scene.entry.layer.empty() ? read_window(path, scene, "StdError") : Image();
}

/// relMSE predicted by the standard errors, with the weights of the true one; NaN if there are none.
double predicted_relmse(const Image& errors, const SceneReferences& references) {
  if (errors.data.empty()) return kNone;
  double sum = 0;
  size_t n = 0;
  for (size_t p = 0; p < errors.data.size() / 3; ++p) {
    double squares = 0;
    for (size_t i = 3 * p; i < 3 * p + 3; ++i) squares += static_cast<double>(errors.data[i]) * errors.data[i] / 3;
    const double value = squares * relative_weight(references.images, references.denominators, p);
    if (std::isfinite(value)) sum += value, ++n;
  }
  return sum / static_cast<double>(n);
}

/// RunResult::coverage; NaN without standard errors. The reference's variance is estimated by (R1 - R2)^2 / 4, which is
/// noisy, so it should be small.
double coverage(const Image& image, const Image& errors, const std::vector<Image>& references) {
  if (errors.data.empty()) return kNone;
  constexpr double kNormal95 = 1.96;
  size_t n = 0, n_inside = 0;
  for (size_t i = 0; i < errors.data.size(); ++i) {
    const double a = references.front().data[i], b = references.back().data[i];
    const double deviation = image.data[i] - (a + b) / 2, error = errors.data[i];
    if (!std::isfinite(deviation) || !std::isfinite(error)) continue;
    ++n;
    n_inside += std::abs(deviation) <= kNormal95 * std::hypot(error, (a - b) / 2);
  }
  return static_cast<double>(n_inside) / static_cast<double>(n);
}

double number_or_none(const nlohmann::json& json, const char* name) {
  return json.contains(name) && json[name].is_number() ? json[name].get<double>() : kNone;
}

/// Measures the values in kKept.
void measure_image(const Image& image, const SceneInstance& scene, const SceneReferences& references,
                   const Cache& cache, const std::string& key, RunResult& run) {
  if (const std::optional<nlohmann::json> kept = cache.read_json("measures", key + ".json");
      kept && kept->contains("predicted_relmse_low")) {
    for (const auto& [name, member] : kKept) run.*member = number_or_none(*kept, name);
    return;
  }
  const std::string& path = run.record.image;
  const Image std_error = standard_errors(path, scene);
  const auto error = [&](Metric metric) { return mean_metric(metric, image, references, scene); };
  run.relmse_trimmed = error(Metric::kRelMseTrimmed);
  run.mae = error(Metric::kMae), run.flip = error(Metric::kFlip), run.above5 = error(Metric::kAbove5);
  run.predicted_relmse = predicted_relmse(std_error, references);
  run.coverage = coverage(image, std_error, references.images);
  // Bounds that a single image reports for its relMSE; those of frames are per frame.
  if (const std::vector<std::string> files = files_of(scene.frames, path); files.size() == 1 && !std_error.data.empty())
    if (const auto bounds = predicted_bounds(inspect_image(files[0])))
      run.predicted_low = (*bounds)[0], run.predicted_high = (*bounds)[1];
  nlohmann::json kept;
  for (const auto& [name, member] : kKept) kept[name] = run.*member;
  cache.write_json("measures", key + ".json", kept);
}

void set_bounds(Cell& cell) {
  double predicted = 0, bounded = 0, hold = 0;
  for (const RunResult& run : cell.runs) {
    predicted += std::isfinite(run.predicted_relmse), bounded += std::isfinite(run.predicted_low);
    hold += run.predicted_low <= run.relmse && run.relmse <= run.predicted_high;
  }
  cell.bounded = bounded / predicted, cell.bounds_hold = hold / bounded;
}

Image mean_of(const std::vector<Image>& images) {
  Image mean(images[0].width, images[0].height, 3);
  for (size_t i = 0; i < mean.data.size(); ++i) {
    double sum = 0;
    for (const Image& image : images) sum += static_cast<double>(image.data[i]);
    mean.data[i] = static_cast<float>(sum / static_cast<double>(images.size()));
  }
  return mean;
}

template <typename Value>
std::vector<double> values_of(const Cell& cell, Value&& value) {
  std::vector<double> values;
  for (const RunResult& run : cell.runs) values.push_back(value(run));
  return values;
}

double temporal(const RunResult& run) { return run.temporal; }
double mean_of(const std::vector<double>& values) { return mean_estimate(values).value; }
Estimate ratio(const Pairs& pairs) { return geometric_mean_of_ratios({&pairs, 1}); }

size_t baseline_of(const Suite& suite) {
  size_t baseline = 0;
  while (suite.methods[baseline].name != suite.baseline) ++baseline;
  return baseline;
}

double published(const std::map<std::string, std::map<std::string, std::map<std::string, double>>>& table,
                 const std::string& scene, const std::string& method, const std::string& budget) {
  const auto s = table.find(scene);
  if (s == table.end()) return kNone;
  const auto m = s->second.find(method);
  if (m == s->second.end()) return kNone;
  const auto b = m->second.find(budget);
  return b == m->second.end() ? kNone : b->second;
}

/// Slope of error against samples over all budgets in samples, using the seeds common to all of them.
Slope slope_of(const Results& results, size_t scene, size_t method) {
  std::vector<double> samples;
  std::vector<const Cell*> cells;
  for (size_t b = 0; b < results.suite.budgets.size(); ++b)
    if (const Cell* cell = results.find(scene, method, b); cell && results.suite.budgets[b].spp) {
      samples.push_back(cell->samples_per_pixel);
      cells.push_back(cell);
    }
  std::vector<std::vector<double>> errors(cells.size());
  for (uint64_t seed : results.suite.seeds) {
    std::vector<double> of_seed;
    for (const Cell* cell : cells)
      for (const RunResult& run : cell->runs)
        if (run.seed == seed) of_seed.push_back(run.relmse);
    if (of_seed.size() != cells.size()) continue;
    for (size_t b = 0; b < cells.size(); ++b) errors[b].push_back(of_seed[b]);
  }
  return {scene, method, convergence_slope(samples, errors)};
}

bool is_usable(const Estimate& e) { return e.value > 0 && std::isfinite(e.value); }

/// Whether error and ratios to the baseline are positive; unbiased estimates of small errors may be negative.
bool is_usable(const Results& results, size_t scene, size_t method, size_t budget) {
  const Cell* cell = results.find(scene, method, budget);
  return cell && is_usable(cell->split.relative.error) && is_usable(cell->equal_time) &&
         (results.suite.budgets[budget].spp == 0 || is_usable(cell->equal_sample));
}

/// Scenes that enter all summaries of a budget.
std::vector<size_t> common_scenes(const Results& results, size_t budget) {
  const size_t n_scenes = results.scenes.size(), n_methods = results.suite.methods.size();
  std::vector<size_t> common;
  for (size_t s = 0; s < n_scenes; ++s) common.push_back(s);
  for (size_t m = 0; m < n_methods; ++m) {
    std::vector<size_t> of_method;
    for (size_t s = 0; s < n_scenes; ++s)
      if (is_usable(results, s, m, budget)) of_method.push_back(s);
    if (of_method.empty()) continue;
    std::erase_if(common,
                  [&](size_t s) { return std::find(of_method.begin(), of_method.end(), s) == of_method.end(); });
  }
  return common;
}

std::optional<Summary> summary_of(const Results& results, const std::vector<size_t>& common, size_t method,
                                  size_t budget) {
  Summary summary{method, budget};
  bool has_cells = false;
  for (size_t s = 0; s < results.scenes.size(); ++s) {
    has_cells = has_cells || results.find(s, method, budget);
    if (!is_usable(results, s, method, budget)) summary.unusable.push_back(s);
  }
  if (!has_cells) return {};
  if (summary.unusable.size() == results.scenes.size()) return summary;
  std::vector<Pairs> equal_sample, equal_time;
  std::vector<double> error, published_ratio, samples, flip;
  for (size_t s : common) {
    const Cell& cell = *results.find(s, method, budget);
    const Cell& base = *results.find(s, baseline_of(results.suite), budget);
    if (results.suite.budgets[budget].spp) equal_sample.push_back(at_equal_samples(base, cell));
    equal_time.push_back(at_equal_time(base, cell, results.suite.budgets[budget]));
    error.push_back(cell.split.relative.error.value);
    published_ratio.push_back(cell.published_ratio);
    samples.push_back(cell.samples_per_pixel);
    flip.push_back(cell.flip.value);
    summary.equal_sample_normalised = summary.equal_sample_normalised || cell.equal_sample_normalised;
  }
  summary.n_scenes = common.size();
  if (common.empty()) return summary;
  summary.samples_per_pixel = mean_of(samples);
  summary.equal_sample = geometric_mean_of_ratios(equal_sample);
  summary.equal_time = geometric_mean_of_ratios(equal_time);
  summary.relmse = geometric_mean(error);
  summary.flip = mean_of(flip);
  summary.published_ratio = geometric_mean(published_ratio);
  return summary;
}

/// Warns of scenes that enter no summary of the budget, naming the methods responsible.
void warn_of_left_out(Results& results, const std::vector<size_t>& common, size_t budget) {
  const Suite& suite = results.suite;
  for (size_t s = 0; s < results.scenes.size(); ++s) {
    if (std::find(common.begin(), common.end(), s) != common.end()) continue;
    std::string methods;
    for (const Summary& summary : results.summaries)
      if (summary.budget == budget && summary.unusable.size() < results.scenes.size() &&
          std::find(summary.unusable.begin(), summary.unusable.end(), s) != summary.unusable.end())
        methods += (methods.empty() ? "" : ", ") + suite.methods[summary.method].name;
    if (!methods.empty())
      results.warnings.push_back(
          fmt::format("no summary at {} counts {}, where {} has no positive error, or no ratio: more seeds, or better "
                      "references, would help",
                      suite.budgets[budget].label(), suite.scenes[s].name, methods));
  }
}

}  // namespace

void measure(Cell& cell, const SceneInstance& scene, const SceneReferences& references, bool unbiased,
             const Budget& budget, const Cache& cache, const std::vector<std::string>& run_keys,
             const std::string& reference_key) {
  const size_t n = cell.runs.size();
  std::vector<Image> images(n);
  parallel_for(n, [&](size_t s) {
    RunResult& run = cell.runs[s];
    images[s] = read_window(run.record.image, scene);
    const std::string key = key_text(run_keys[s] + " relative to denoised " + reference_key + scene.entry.layer);
    measure_image(images[s], scene, references, cache, key, run);
    run.frames = frame_errors(images[s], references, scene);
    const SequenceSummary of_frames = summary_of(run.frames);
    run.temporal = of_frames.temporal, run.temporal_flip = of_frames.temporal_flip;
  });
  cell.split = split_error(images, references.images, references.denominators);
  for (size_t s = 0; s < n; ++s) {
    cell.runs[s].relmse = cell.split.relative.of_render[s];
    cell.runs[s].mse = cell.split.absolute.of_render[s];
    cell.runs[s].mean_ratio = cell.split.mean_ratio_of_render[s];
  }
  cell.relmse_trimmed = mean_estimate(values_of(cell, [](const RunResult& r) { return r.relmse_trimmed; }));
  cell.mae = mean_estimate(values_of(cell, [](const RunResult& r) { return r.mae; }));
  cell.flip = mean_estimate(values_of(cell, [](const RunResult& r) { return r.flip; }));
  cell.above5 = mean_estimate(values_of(cell, [](const RunResult& r) { return r.above5; }));
  if (n > 1) {
    const Image average = mean_of(images);
    cell.mae_of_mean = mean_metric(Metric::kMae, average, references, scene);
    cell.flip_of_mean = mean_metric(Metric::kFlip, average, references, scene);
  }
  cell.load_seconds = mean_estimate(values_of(cell, [](const RunResult& r) { return r.record.load_seconds; }));
  cell.render_seconds = mean_estimate(values_of(cell, [](const RunResult& r) { return r.record.render_seconds; }));
  cell.estimate_seconds = mean_estimate(values_of(cell, [](const RunResult& r) { return r.record.estimate_seconds; }));
  cell.then_seconds = mean_estimate(values_of(cell, [](const RunResult& r) { return r.record.then_seconds; }));
  cell.method_seconds = mean_estimate(values_of(cell, seconds));
  cell.processor_seconds =
      mean_estimate(values_of(cell, [](const RunResult& r) { return r.record.processor_seconds; }));
  if (budget.seconds > 0) cell.time_ratio = cell.method_seconds.value / budget.seconds;
  cell.samples_per_pixel = mean_of(values_of(cell, [](const RunResult& r) { return r.record.samples_per_pixel; }));
  for (const RunResult& run : cell.runs)
    cell.peak_memory_bytes = std::max(cell.peak_memory_bytes, run.record.peak_memory_bytes);
  cell.efficiency = reciprocal_of_means(values_of(cell, relmse), values_of(cell, seconds));
  cell.predicted_over_true =
      ratio_of_means(values_of(cell, [](const RunResult& r) { return r.predicted_relmse; }), values_of(cell, relmse));
  cell.coverage = mean_estimate(values_of(cell, [](const RunResult& r) { return r.coverage; }));
  cell.temporal = mean_estimate(values_of(cell, temporal));
  cell.temporal_flip = mean_estimate(values_of(cell, [](const RunResult& r) { return r.temporal_flip; }));
  std::vector<std::vector<FrameErrors>> frames;
  for (const RunResult& run : cell.runs) frames.push_back(run.frames);
  cell.frames = mean_over_renders(frames);
  set_bounds(cell);
  cell.suspicions = suspicions(cell.split, unbiased);
}

namespace {

/// Clock and processor disagree by more than this about how long a method takes beside the baseline.
constexpr double kTimesApart = 1.3;

/// What a busy machine, or threads that one method has no use for, do to equal time.
void warn_of_busy_machine(const Cell& cell, Results& results) {
  const double apart = cell.clock_ratio / cell.processor_ratio;
  if (!(std::max(apart, 1 / apart) > kTimesApart)) return;
  const Suite& suite = results.suite;
  std::string text = fmt::format(
      "{}, {}, {}: by the clock it took {:.2g} times the time of {}, but {:.2g} times its processor time: the machine "
      "was busy with other work, or one of both uses fewer threads",
      suite.scenes[cell.scene].name, suite.methods[cell.method].name, suite.budgets[cell.budget].label(),
      cell.clock_ratio, suite.baseline, cell.processor_ratio);
  if (std::isfinite(cell.equal_processor_time.value))
    text += fmt::format("; at equal processor time the ratio of errors is {:.3g}, at equal time {:.3g}",
                        cell.equal_processor_time.value, cell.equal_time.value);
  results.warnings.push_back(text);
}

}  // namespace

void compare_cells(Results& results) {
  const Suite& suite = results.suite;
  const size_t baseline = baseline_of(suite);
  for (Cell& cell : results.cells) {
    const std::string& scene = suite.scenes[cell.scene].name;
    const std::string& method = suite.methods[cell.method].name;
    const Budget& budget = suite.budgets[cell.budget];
    cell.published_relmse = published(suite.published_relmse, scene, method, budget.key());
    cell.published_ratio = published(suite.published_ratio, scene, method, budget.key());
    const Cell* base = results.find(cell.scene, baseline, cell.budget);
    if (!base) continue;
    if (!cell.frames.empty() && cell.frames.size() == base->frames.size()) {
      cell.temporal_gain = ratio(in_pairs(*base, cell, temporal));
      cell.worst = worst_regions(cell.frames, base->frames);
    }
    cell.equal_time = ratio(at_equal_time(*base, cell, budget));
    const bool timed = cell.processor_seconds.value > 0 && base->processor_seconds.value > 0;
    if (timed && base->method_seconds.value > 0) {
      cell.clock_ratio = cell.method_seconds.value / base->method_seconds.value;
      cell.processor_ratio = cell.processor_seconds.value / base->processor_seconds.value;
    }
    if (timed && budget.spp > 0) cell.equal_processor_time = ratio(at_equal_processor_time(*base, cell));
    warn_of_busy_machine(cell, results);
    if (budget.seconds > 0) continue;
    const double taken = cell.samples_per_pixel, taken_by_base = base->samples_per_pixel;
    cell.equal_sample_normalised = std::abs(taken - taken_by_base) > kSameSamples * std::min(taken, taken_by_base);
    cell.equal_sample = ratio(at_equal_samples(*base, cell));
  }
  for (size_t s = 0; s < results.scenes.size(); ++s)
    for (size_t m = 0; m < suite.methods.size(); ++m)
      if (Slope slope = slope_of(results, s, m); std::isfinite(slope.exponent.value)) results.slopes.push_back(slope);
  for (size_t b = 0; b < suite.budgets.size(); ++b) {
    const std::vector<size_t> common = common_scenes(results, b);
    for (size_t m = 0; m < suite.methods.size(); ++m)
      if (const std::optional<Summary> summary = summary_of(results, common, m, b)) {
        results.summaries.push_back(*summary);
        if (summary->equal_sample_normalised)
          results.warnings.push_back(fmt::format(
              "{} took {:g} samples per pixel and {} another number at {}: their ratio for equal samples is of error × "
              "samples, as if errors fell like 1 / samples",
              suite.methods[m].name, summary->samples_per_pixel, suite.baseline, suite.budgets[b].label()));
      }
    warn_of_left_out(results, common, b);
  }
}

}  // namespace covary::lab
