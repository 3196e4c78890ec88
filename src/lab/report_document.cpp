// SPDX-License-Identifier: Apache-2.0
#include "lab/report_document.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "lab/report_tables.h"
#include "lab/scene_images.h"
#include "metrics/metrics.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

void add_block(Json& section, Json block) {
  if (!block.is_null()) section["blocks"].push_back(std::move(block));
}

void add_section(Json& document, Json section) {
  if (!section["blocks"].empty()) document["sections"].push_back(std::move(section));
}

Json new_section(const std::string& id, const std::string& heading, std::vector<std::string> text = {}) {
  return {{"id", id}, {"heading", heading}, {"text", text}, {"blocks", Json::array()}};
}

Json notes(const char* kind, const std::vector<std::string>& items) {
  if (items.empty()) return nullptr;
  return {{"type", "notes"}, {"kind", kind}, {"items", items}};
}

std::string text_of(const Failure& f) {
  std::string where = f.scene;
  for (const std::string& part : {f.method, f.budget})
    if (!part.empty()) where += (where.empty() ? "" : ", ") + part;
  std::string text = where + ": " + f.message;
  if (f.exit_code) text += fmt::format(" (exit code {})", f.exit_code);
  if (f.not_tried) text += fmt::format("; {} further runs were not tried", f.not_tried);
  return f.command.empty() ? text : text + "\n" + f.command;
}

Json meta(const Results& results) {
  const Suite& suite = results.suite;
  std::string budgets;
  for (const Budget& budget : suite.budgets) budgets += (budgets.empty() ? "" : ", ") + budget.label();
  const Json& machine = results.machine;
  Json pairs = Json::array();
  const auto add = [&](const char* name, const std::string& value) { pairs.push_back(Json::array({name, value})); };
  add("Suite", suite.name);
  add("Budgets", budgets);
  add("Seeds", fmt::format("{}", suite.seeds.size()));
  add("Baseline", suite.baseline);
  add("Version", results.version);
  add("Date", results.date);
  if (machine.is_object())
    add("Machine",
        fmt::format("{}, {} cores, {:.0f} GiB, {}", machine.value("processor", ""), machine.value("cores", 0),
                    machine.value("memory_bytes", 0.0) / 1073741824, machine.value("system", "")));
  add("Command", results.command);
  return pairs;
}

Json methods_table(const Suite& suite) {
  Json rows = Json::array();
  for (const MethodEntry& method : suite.methods) {
    std::string options = fmt::format("{}", fmt::join(method.options, " "));
    if (!method.program.empty())
      options += (options.empty() ? "" : " | ") + fmt::format("program or function '{}'", method.program);
    for (const auto& step : method.then) options += fmt::format(" | covary {}", fmt::join(step, " "));
    rows.push_back({{"name", method.name}, {"options", options}});
  }
  return {{"type", "table"},
          {"caption", fmt::format("Options of covary render; common to all: {}", fmt::join(suite.common_options, " "))},
          {"columns",
           {{{"key", "name"}, {"title", "Method"}, {"kind", "text"}},
            {{"key", "options"}, {"title", "Options"}, {"kind", "text"}}}},
          {"rows", rows}};
}

Json scenes_table(const Results& results) {
  const auto column = [](const char* key, const char* title, const char* kind) {
    return Json{{"key", key}, {"title", title}, {"kind", kind}};
  };
  Json rows = Json::array();
  for (const SceneResult& result : results.scenes) {
    const SceneInstance& scene = result.scene;
    rows.push_back({{"name", scene.entry.name},
                    {"frame", fmt::format("{} × {}{}", scene.frame_width, scene.frame_height,
                                          scene.frames.empty() ? "" : fmt::format(", {} frames", scene.frames.size()))},
                    {"window", fmt::format("{} × {} at {}, {}", scene.window.width, scene.window.height, scene.window.x,
                                           scene.window.y)},
                    {"reference",
                     result.reference.spp ? fmt::format("2 × {} spp", result.reference.spp) : result.reference.origin},
                    {"error", std::isfinite(result.reference.relmse) ? Json(result.reference.relmse) : Json(nullptr)},
                    {"credit", scene.entry.credit}});
  }
  return {{"type", "table"},
          {"caption", "Scenes and references"},
          {"columns",
           {column("name", "Scene", "text"), column("frame", "Frame", "text"),
            column("window", "Pixels measured", "text"), column("reference", "Reference", "text"),
            column("error", "relMSE of the reference", "number"), column("credit", "Credit", "text")}},
          {"rows", rows}};
}

const std::vector<std::string> kHowMeasured = {
    "Every number is a mean over seeds. Intervals contain the true value with probability 95 %: Student's t over the "
    "seeds, widened by the references' own noise.",
    "relMSE and MSE use the product (F − R₁)(F − R₂) of the differences to two independent references, in which the "
    "references' noise cancels; the squared bias is the same product over pairs of different seeds. Negative values "
    "are too small to measure. MAE and FLIP are against the mean of the references and include its noise.",
    "Equal samples: error of the baseline over error of the method with the same number of samples; if the numbers of "
    "samples differ by more than 1 %, each error is multiplied by its samples, as if errors fell like 1 / samples. "
    "Equal time: the same with each error multiplied by the method's time (render, estimate and later steps, without "
    "loading), as if errors fell like 1 / time; with a budget in seconds, the errors themselves.",
    "For sequences, errors are means over all frames. Temporal error: relMSE of the differences of successive frames, "
    "which measures flicker and trails; temporal FLIP: |FLIP of successive frames − FLIP of those of the reference|; "
    "worst region: largest ratio of mean errors to the baseline's in any region."};

/// For a sequence, the last frame is shown.
Image shown_image(const Image& pixels, const SceneInstance& scene) { return images_of(pixels, scene).back(); }

Image mean_of_references(const SceneResult& result) {
  Image mean = read_window(result.reference.files.front(), result.scene);
  const Image other = read_window(result.reference.files.back(), result.scene);
  for (size_t i = 0; i < mean.data.size(); ++i) mean.data[i] = 0.5f * (mean.data[i] + other.data[i]);
  return shown_image(mean, result.scene);
}

}  // namespace

size_t shown_budget(const Suite& suite) {
  for (size_t b = 0; b < suite.budgets.size(); ++b)
    if (suite.show && suite.budgets[b] == *suite.show) return b;
  return suite.budgets.size() - 1;
}

Json report_document(const Results& results) {
  const Suite& suite = results.suite;
  Json document{
      {"title", suite.title}, {"subtitle", suite.description}, {"meta", meta(results)}, {"sections", Json::array()}};
  const size_t shown = shown_budget(suite);

  Json summary = new_section("summary", "Summary");
  std::vector<std::string> failures;
  for (const Failure& failure : results.failures) failures.push_back(text_of(failure));
  add_block(summary, notes("error", failures));
  add_block(summary, notes("result", verdicts(results, shown)));
  for (size_t b = 0; b < suite.budgets.size(); ++b) add_block(summary, summary_table(results, b));
  add_block(summary, notes("warning", results.warnings));
  add_section(document, std::move(summary));

  Json errors = new_section("errors", "Errors");
  for (size_t b = 0; b < suite.budgets.size(); ++b) add_block(errors, error_table(results, b));
  add_section(document, std::move(errors));

  Json published = new_section("published", "Published values");
  for (size_t b = 0; b < suite.budgets.size(); ++b) add_block(published, published_table(results, b));

  Json gains = new_section("gains", "Gains");
  for (size_t b = 0; b < suite.budgets.size(); ++b) add_block(gains, ratio_table(results, b));
  if (!suite.published_source.empty())
    (published["blocks"].empty() ? gains : published)["text"].push_back("Published: " + suite.published_source + ".");
  add_section(document, std::move(published));
  add_section(document, std::move(gains));

  Json frames = new_section("frames", "Frames");
  for (const bool of_changes : {false, true})
    for (size_t s = 0; s < suite.scenes.size(); ++s) add_block(frames, frames_plot(results, s, shown, of_changes));
  for (size_t b = 0; b < suite.budgets.size(); ++b) add_block(frames, frames_table(results, b));
  add_section(document, std::move(frames));

  Json quality = new_section("bias", "Bias, variance and other measures");
  add_block(quality, front_plot(results, shown));
  add_block(quality, quality_table(results, shown));
  add_section(document, std::move(quality));

  Json convergence = new_section("convergence", "Convergence");
  if (suite.budgets.size() > 1) {
    for (size_t s = 0; s < suite.scenes.size(); ++s) add_block(convergence, convergence_plot(results, s));
    add_block(convergence, slope_table(results));
  }
  add_section(document, std::move(convergence));

  Json time = new_section("time", "Time");
  for (size_t s = 0; s < suite.scenes.size(); ++s) add_block(time, time_plot(results, s));
  add_block(time, time_table(results, shown));
  add_section(document, std::move(time));

  Json setup = new_section("setup", "How it was measured", kHowMeasured);
  add_block(setup, methods_table(suite));
  add_block(setup, scenes_table(results));
  add_section(document, std::move(setup));
  return document;
}

namespace {

/// Summaries of a budget's methods that include the largest number of scenes.
std::vector<const Summary*> comparable(const Results& results, size_t budget) {
  size_t most = 0;
  for (const Summary& s : results.summaries)
    if (s.budget == budget) most = std::max(most, s.n_scenes);
  std::vector<const Summary*> all;
  for (const Summary& s : results.summaries)
    if (s.budget == budget && s.n_scenes == most) all.push_back(&s);
  return all;
}

/// Two digits, without an exponent: 0.000073, 0.73, 19, 6300.
std::string factor_text(double value) {
  if (value > 0 && value < 1e-4)
    return fmt::format("{:.{}f}", value, 1 - static_cast<int>(std::floor(std::log10(value))));
  if (!(value >= 100) || !std::isfinite(value)) return fmt::format("{:.2g}", value);
  const double unit = std::pow(10, std::floor(std::log10(value)) - 1);
  return fmt::format("{:.0f}", std::round(value / unit) * unit);
}

/// Of a method that took much longer than its budget of time.
std::string overrun_text(const Results& results, size_t budget, size_t method) {
  double most = 0;
  for (const Cell& cell : results.cells)
    if (cell.budget == budget && cell.method == method) most = std::max(most, cell.time_ratio);
  return most > 1.25 ? fmt::format(" But it took up to {:.2g} times that long.", most) : "";
}

/// "At equal samples (192 spp) balanced has the lowest error: 8.1 times lower than pt (7.0 to 9.4). Not clearly worse:
/// error." Empty if nothing is significantly better than the baseline.
std::string verdict(const Results& results, size_t budget, const std::string& condition, Estimate Summary::*ratio) {
  constexpr double kClearly = 1.2, kMuchLess = 0.5;  // without an interval; of the largest factor
  const Suite& suite = results.suite;
  const Summary* best = nullptr;
  const std::vector<const Summary*> all = comparable(results, budget);
  for (const Summary* s : all)
    if (suite.methods[s->method].name != suite.baseline && std::isfinite((s->*ratio).value) &&
        (!best || (s->*ratio).value > (best->*ratio).value))
      best = s;
  if (!best) return "";
  const Estimate& gain = best->*ratio;
  if (!(gain.value > 1))
    return fmt::format("{} no method has less error than '{}'; next is '{}', with {:.2g} times as much.", condition,
                       suite.baseline, suite.methods[best->method].name, 1 / gain.value);
  const bool is_known = std::isfinite(gain.low);
  const std::string range = is_known ? fmt::format("({} to {})", factor_text(gain.low), factor_text(gain.high))
                                     : "(no interval is known from one seed)";
  if (gain.low <= 1 || (!is_known && gain.value < kClearly))
    return fmt::format(
        "{} no method has clearly less error than '{}': that of '{}' is {} times lower {}, which these "
        "seeds and scenes do not tell from 1.",
        condition, suite.baseline, suite.methods[best->method].name, factor_text(gain.value), range);
  std::string text = fmt::format("{} '{}' has the lowest error: {} times lower than '{}'", condition,
                                 suite.methods[best->method].name, factor_text(gain.value), suite.baseline);
  text += fmt::format(" {}.", range);
  if (!is_known) return text;
  std::vector<std::string> as_good, untold;  // by their intervals, which may be wide
  for (const Summary* s : all)
    if (s != best && (s->*ratio).high >= gain.low)
      ((s->*ratio).value < kMuchLess * gain.value ? untold : as_good).push_back(suite.methods[s->method].name);
  if (!as_good.empty()) text += fmt::format(" Not clearly worse: '{}'.", fmt::join(as_good, "', '"));
  if (!untold.empty()) text += fmt::format(" Too few seeds to tell: '{}'.", fmt::join(untold, "', '"));
  return text + overrun_text(results, budget, best->method);
}

/// The standard error of the difference of two methods' FLIP, over scenes; NaN with a single seed.
double flip_noise(const Results& results, size_t budget, const Summary& a, const Summary& b) {
  double squares = 0;
  size_t n_cells = 0;
  for (const Cell& cell : results.cells)
    if (cell.budget == budget && (cell.method == a.method || cell.method == b.method))
      squares += cell.flip.standard_error * cell.flip.standard_error, ++n_cells;
  return std::sqrt(squares) / (0.5 * static_cast<double>(n_cells));
}

std::string flip_verdict(const Results& results, size_t budget) {
  constexpr double kSeen = 0.02, kClearly = 2;  // of FLIP itself; standard errors
  const Suite& suite = results.suite;
  const Summary *best = nullptr, *baseline = nullptr;
  for (const Summary* s : comparable(results, budget)) {
    if (suite.methods[s->method].name == suite.baseline) baseline = s;
    if (!best || s->flip < best->flip) best = s;
  }
  if (!best || best == baseline || !std::isfinite(best->flip)) return "";
  const std::string& name = suite.methods[best->method].name;
  const double gain = baseline ? baseline->flip - best->flip : kNone;
  const std::string start = fmt::format("To the eye, as FLIP measures it with {}, ", suite.budgets[budget].label());
  if (baseline &&
      !(gain > kSeen * baseline->flip && !(gain < kClearly * flip_noise(results, budget, *best, *baseline))))
    return start + fmt::format("no method is clearly nearer to the reference than '{}' ({:.2g}; '{}' {:.2g}).",
                               suite.baseline, baseline->flip, name, best->flip);
  return start + fmt::format("'{}' is nearest to the reference: {:.2g}, '{}' {:.2g}.", name, best->flip, suite.baseline,
                             baseline ? baseline->flip : kNone);
}

}  // namespace

std::vector<std::string> verdicts(const Results& results, size_t budget) {
  const std::vector<Budget>& budgets = results.suite.budgets;
  const Budget& of = budgets[budget];
  std::vector<std::string> all;
  for (size_t b = budgets.size(); b-- > 0 && of.spp == 0 && all.empty();)
    if (budgets[b].spp > 0)
      all.push_back(
          verdict(results, b, fmt::format("At equal samples ({})", budgets[b].label()), &Summary::equal_sample));
  if (of.spp > 0)
    all.push_back(verdict(results, budget, fmt::format("At equal samples ({})", of.label()), &Summary::equal_sample));
  size_t timed = budget;  // a time limit, if there is one, rather than the time that samples took
  for (size_t b = 0; b < budgets.size() && of.spp > 0; ++b)
    if (budgets[b].spp == 0) timed = b;
  const Budget& of_time = budgets[timed];
  all.push_back(verdict(results, timed,
                        fmt::format("At equal time ({}{})", of_time.spp > 0 ? "measured with " : "", of_time.label()),
                        &Summary::equal_time));
  all.push_back(flip_verdict(results, budget));
  std::erase(all, "");
  return all;
}

std::string best_method(const Results& results, size_t budget) {
  const Suite& suite = results.suite;
  const bool samples = suite.budgets[budget].spp > 0;
  double most = 0;
  std::string best;
  for (const Summary& s : results.summaries) {
    const double ratio = (samples ? s.equal_sample : s.equal_time).value;
    if (s.budget != budget || suite.methods[s.method].name == suite.baseline || !(ratio > most)) continue;
    most = ratio;
    best = suite.methods[s.method].name;
  }
  return best;
}

void add_pictures(const Results& results, Json& document, std::vector<ReportImage>& images) {
  const Suite& suite = results.suite;
  const size_t budget = shown_budget(suite);
  const std::string best = best_method(results, budget);
  Json scenes = Json::array();
  for (size_t s = 0; s < results.scenes.size(); ++s) {
    const SceneResult& result = results.scenes[s];
    if (result.reference.files.empty()) continue;
    const std::vector<int>& frames = result.scene.frames;
    const std::string frame = frames.empty() ? "" : fmt::format(", frame {}", frames.back());
    Json scene{
        {"name", result.scene.entry.name + frame}, {"credit", result.scene.entry.credit}, {"images", Json::array()}};
    const Image reference = mean_of_references(result);
    for (size_t m = 0; m < suite.methods.size(); ++m) {
      const Cell* cell = results.find(s, m, budget);
      if (!cell) continue;
      const std::string id = fmt::format("s{}m{}", s, m);
      Image pixels = shown_image(read_window(cell->runs[0].record.image, result.scene), result.scene);
      const RunResult& run = cell->runs[0];
      images.push_back({id + "flip", compute_metric(Metric::kFlip, pixels, {&reference, 1}).map});
      images.push_back({id, std::move(pixels)});
      Json image{{"name", suite.methods[m].name},
                 {"image", id},
                 {"flip", id + "flip"},
                 {"label", fmt::format("relMSE {:.3g}", run.frames.empty() ? run.relmse : run.frames.back().relmse)}};
      if (suite.methods[m].name == suite.baseline) image["role"] = "baseline";
      if (suite.methods[m].name == best) image["role"] = "best";
      scene["images"].push_back(std::move(image));
    }
    if (scene["images"].empty()) continue;
    const std::string id = fmt::format("s{}r", s);
    images.push_back({id, reference});
    scene["images"].push_back({{"name", "reference"}, {"image", id}, {"label", ""}, {"role", "reference"}});
    for (const CropWindow& w : result.scene.entry.insets)
      scene["insets"].push_back(
          {{"x", w.x - result.scene.window.x}, {"y", w.y - result.scene.window.y}, {"w", w.width}, {"h", w.height}});
    scenes.push_back(std::move(scene));
  }
  if (scenes.empty()) return;
  const std::string heading = fmt::format("Images, {}, seed {}", suite.budgets[budget].label(), suite.seeds[0]);
  Json section = new_section("images", heading);
  add_block(section, {{"type", "comparer"}, {"id", "images"}, {"scenes", scenes}});
  // After the summary, before the detailed numbers.
  document["sections"].insert(document["sections"].begin() + 1, std::move(section));
}

}  // namespace covary::lab
