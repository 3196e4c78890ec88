// SPDX-License-Identifier: Apache-2.0
#include "lab/report_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "lab/json_values.h"
#include "lab/statistics.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

Json value_of(const Estimate& e) {
  if (!std::isfinite(e.value)) return nullptr;
  Json json{{"value", e.value}};
  if (std::isfinite(e.low)) json["low"] = e.low, json["high"] = e.high;
  return json;
}

Json column(const std::string& key, const std::string& title, const char* kind, const char* better = nullptr) {
  Json json{{"key", key}, {"title", title}, {"kind", kind}};
  if (better) json["better"] = better;
  return json;
}

Json table(const std::string& caption, Json columns, Json rows) {
  if (rows.empty()) return nullptr;
  return {{"type", "table"}, {"caption", caption}, {"columns", std::move(columns)}, {"rows", std::move(rows)}};
}

bool any_cell(const Results& results, size_t budget, bool (*has)(const Cell&)) {
  return std::any_of(results.cells.begin(), results.cells.end(),
                     [&](const Cell& cell) { return cell.budget == budget && has(cell); });
}

bool every_cell(const Cell&) { return true; }

/// Heading of a method's column, with its number of samples if that differs from the budget.
std::string method_title(const Results& results, size_t method, size_t budget) {
  const std::string& name = results.suite.methods[method].name;
  const double asked = results.suite.budgets[budget].spp;
  for (const Summary& s : results.summaries)
    if (s.method == method && s.budget == budget && asked > 0 && std::isfinite(s.samples_per_pixel) &&
        s.samples_per_pixel != asked)
      return fmt::format("{} ({:.4g} spp)", name, s.samples_per_pixel);
  return name;
}

/// Note for captions if equal-sample ratios are normalised from errors at different numbers of samples.
std::string normalised_note(const Results& results, size_t budget) {
  const bool any = any_cell(results, budget, [](const Cell& c) { return c.equal_sample_normalised; });
  return any ? "; if methods took different numbers of samples, equal samples: ratio of error × samples" : "";
}

/// Rows for the cells at a budget that `use` accepts; scene and method are the first columns.
template <typename Fill>
Json cell_rows(const Results& results, size_t budget, Fill&& fill, bool (*use)(const Cell&) = every_cell) {
  Json rows = Json::array();
  for (const Cell& cell : results.cells) {
    if (cell.budget != budget || !use(cell)) continue;
    Json row{{"scene", results.suite.scenes[cell.scene].name}, {"method", results.suite.methods[cell.method].name}};
    fill(cell, row);
    rows.push_back(std::move(row));
  }
  return rows;
}

Json plot(const std::string& title, const std::string& x_label, Json series, const std::string& alt,
          const Json& y_axis = {{"label", "relMSE"}, {"scale", "log"}}, const char* x_scale = "log") {
  if (series.empty()) return nullptr;
  return {{"type", "plot"},
          {"title", title},
          {"x", {{"label", x_label}, {"scale", x_scale}}},
          {"y", y_axis},
          {"series", std::move(series)},
          {"alt", alt}};
}

/// One line per method over its budgets in samples, or in seconds, of whose time trials are a part.
template <typename X>
Json error_series(const Results& results, size_t scene, bool in_samples, X&& x) {
  Json series = Json::array();
  for (size_t m = 0; m < results.suite.methods.size(); ++m) {
    Json line{{"name", results.suite.methods[m].name},
              {"x", Json::array()},
              {"y", Json::array()},
              {"low", Json::array()},
              {"high", Json::array()},
              {"style", "line"}};
    std::vector<const Cell*> cells;
    for (size_t b = 0; b < results.suite.budgets.size(); ++b) {
      const Cell* cell = results.find(scene, m, b);
      const bool is_of_kind = (results.suite.budgets[b].spp > 0) == in_samples;
      if (cell && is_of_kind && cell->split.relative.error.value > 0) cells.push_back(cell);
    }
    std::ranges::stable_sort(cells, {}, [&](const Cell* cell) { return x(*cell); });
    for (const Cell* cell : cells) {
      const Estimate& error = cell->split.relative.error;
      line["x"].push_back(x(*cell));
      line["y"].push_back(error.value);
      // A logarithmic axis cannot reach zero.
      line["low"].push_back(json_number(std::max(error.low, 0.1 * error.value)));
      line["high"].push_back(json_number(error.high));
    }
    if (!line["x"].empty()) series.push_back(std::move(line));
  }
  return series;
}

/// "pt 0.013 to 0.0012, iicv 0.0018 to 0.0004": text alternative of a plot.
std::string alternative(const std::string& start, const Json& series) {
  std::string text = start;
  for (const Json& line : series)
    text += fmt::format("; {}: {:.2g} to {:.2g}", line["name"].get<std::string>(), line["y"].front().get<double>(),
                        line["y"].back().get<double>());
  return text;
}

/// "door, house".
std::string names_of(const Results& results, const std::vector<size_t>& scenes) {
  std::string names;
  for (size_t s : scenes) names += (names.empty() ? "" : ", ") + results.suite.scenes[s].name;
  return names;
}

}  // namespace

Json summary_table(const Results& results, size_t budget) {
  const bool samples = results.suite.budgets[budget].spp > 0;
  bool published = false, other_samples = !samples, unusable = false;
  Json rows = Json::array();
  for (const Summary& s : results.summaries) {
    if (s.budget != budget) continue;
    other_samples = other_samples || s.samples_per_pixel != results.suite.budgets[budget].spp;
    published = published || std::isfinite(s.published_ratio);
    rows.push_back({{"method", results.suite.methods[s.method].name},
                    {"n", fmt::format("{}", s.n_scenes)},
                    {"spp", json_number(s.samples_per_pixel)},
                    {"relmse", json_number(s.relmse)},
                    {"flip", json_number(s.flip)},
                    {"sample", value_of(s.equal_sample)},
                    {"time", value_of(s.equal_time)},
                    {"published", json_number(s.published_ratio)},
                    {"unusable", names_of(results, s.unusable)}});
    unusable = unusable || !s.unusable.empty();
  }
  Json columns = Json::array({column("method", "Method", "text")});
  if (results.suite.scenes.size() > 1) columns.push_back(column("n", "Scenes", "text"));
  if (other_samples) columns.push_back(column("spp", "spp taken", "number"));
  columns.push_back(column("relmse", "relMSE", "number", "low"));
  if (samples) columns.push_back(column("sample", "Equal samples", "ratio", "high"));
  if (published) columns.push_back(column("published", "Published", "ratio"));
  columns.push_back(column("time", "Equal time", "ratio", "high"));
  columns.push_back(column("flip", "FLIP", "number", "low"));
  if (unusable) columns.push_back(column("unusable", "No usable value in", "text"));
  return table(
      fmt::format("{}: geometric means over the scenes where all methods have values, of FLIP the mean; ratios are "
                  "error of {} / error of the method{}",
                  results.suite.budgets[budget].label(), results.suite.baseline, normalised_note(results, budget)),
      columns, rows);
}

Json error_table(const Results& results, size_t budget) {
  const Suite& suite = results.suite;
  Json columns = Json::array({column("scene", "Scene", "text")}), rows = Json::array();
  for (size_t m = 0; m < suite.methods.size(); ++m)
    columns.push_back(column(fmt::format("m{}", m), method_title(results, m, budget), "number"));
  for (size_t s = 0; s < suite.scenes.size(); ++s) {
    Json row{{"scene", suite.scenes[s].name}};
    for (size_t m = 0; m < suite.methods.size(); ++m)
      if (const Cell* cell = results.find(s, m, budget))
        row[fmt::format("m{}", m)] = value_of(cell->split.relative.error);
    if (row.size() > 1) rows.push_back(std::move(row));
  }
  return table("relMSE, " + suite.budgets[budget].label(), columns, rows);
}

Json published_table(const Results& results, size_t budget) {
  const Json columns{column("scene", "Scene", "text"), column("method", "Method", "text"),
                     column("ours", "Ours", "number"), column("published", "Published", "number"),
                     column("ratio", "Ratio", "ratio")};
  Json rows = cell_rows(
      results, budget,
      [](const Cell& cell, Json& row) {
        const Estimate& error = cell.split.relative.error;
        row["ours"] = value_of(error);
        row["published"] = json_number(cell.published_relmse);
        row["ratio"] = json_number(error.value / cell.published_relmse);
      },
      [](const Cell& cell) { return std::isfinite(cell.published_relmse); });
  return table(fmt::format("relMSE, {}; ratio: ours / published", results.suite.budgets[budget].label()), columns,
               rows);
}

Json ratio_table(const Results& results, size_t budget) {
  const Suite& suite = results.suite;
  const bool samples = suite.budgets[budget].spp > 0;
  const bool published = any_cell(results, budget, [](const Cell& c) { return std::isfinite(c.published_ratio); });
  Json columns{column("scene", "Scene", "text"), column("method", "Method", "text"),
               column("spp", "spp taken", "number")};
  if (samples) columns.push_back(column("sample", "Equal samples", "ratio"));
  if (published) columns.push_back(column("published", "Published", "ratio"));
  columns.push_back(column("time", "Equal time", "ratio"));
  columns.push_back(column("efficiency", "1 / (relMSE × s)", "number"));
  Json rows = cell_rows(results, budget, [](const Cell& cell, Json& row) {
    row["spp"] = cell.samples_per_pixel;
    row["sample"] = value_of(cell.equal_sample);
    row["published"] = json_number(cell.published_ratio);
    row["time"] = value_of(cell.equal_time);
    row["efficiency"] = value_of(cell.efficiency);
  });
  return table(fmt::format("Error of {} / error of the method, {}{}", suite.baseline, suite.budgets[budget].label(),
                           normalised_note(results, budget)),
               columns, rows);
}

Json quality_table(const Results& results, size_t budget) {
  Json columns{column("scene", "Scene", "text"),
               column("method", "Method", "text"),
               column("relmse", "relMSE", "number"),
               column("bias", "Squared bias", "number"),
               column("share", "Bias share", "percent"),
               column("variance", "Variance", "number"),
               column("mean", "Image mean / reference", "number"),
               column("trimmed", "relMSE, trimmed", "number"),
               column("mae", "MAE", "number"),
               column("flip", "FLIP", "number"),
               column("above5", "Pixels above 5 %", "percent"),
               column("predicted", "Predicted / true error", "ratio"),
               column("coverage", "Intervals of values that hold", "percent"),
               column("bounded", "With bounds of the relMSE", "percent"),
               column("hold", "Bounds that hold", "percent")};
  columns[6]["digits"] = 4;
  Json rows = cell_rows(results, budget, [](const Cell& cell, Json& row) {
    const SplitError& split = cell.split.relative;
    row["relmse"] = value_of(split.error);
    row["bias"] = value_of(split.squared_bias);
    row["share"] = json_number(split.squared_bias.value / split.error.value);
    row["variance"] = value_of(split.variance);
    row["mean"] = value_of(cell.split.mean_ratio);
    row["trimmed"] = value_of(cell.relmse_trimmed);
    row["mae"] = value_of(cell.mae);
    row["flip"] = value_of(cell.flip);
    row["above5"] = json_number(cell.above5.value);
    row["predicted"] = value_of(cell.predicted_over_true);
    row["coverage"] = json_number(cell.coverage.value);
    row["bounded"] = json_number(cell.bounded);
    row["hold"] = json_number(cell.bounds_hold);
  });
  return table("Errors divided, " + results.suite.budgets[budget].label(), columns, rows);
}

Json time_table(const Results& results, size_t budget) {
  const bool then = any_cell(results, budget, [](const Cell& c) { return c.then_seconds.value > 0; });
  Json columns{column("scene", "Scene", "text"),      column("method", "Method", "text"),
               column("spp", "spp", "number"),        column("load", "Load", "seconds"),
               column("render", "Render", "seconds"), column("estimate", "Estimate", "seconds")};
  if (then) columns.push_back(column("then", "Then", "seconds"));
  columns.push_back(column("method_seconds", "Method", "seconds"));
  columns.push_back(column("processor", "Processor", "seconds"));
  columns.push_back(column("memory", "Peak memory", "bytes"));
  if (results.suite.budgets[budget].seconds > 0) columns.push_back(column("ratio", "Of the budget", "percent"));
  Json rows = cell_rows(results, budget, [](const Cell& cell, Json& row) {
    row["spp"] = cell.samples_per_pixel;
    row["load"] = json_number(cell.load_seconds.value);
    row["render"] = value_of(cell.render_seconds);
    row["estimate"] = value_of(cell.estimate_seconds);
    row["then"] = value_of(cell.then_seconds);
    row["method_seconds"] = value_of(cell.method_seconds);
    row["processor"] = value_of(cell.processor_seconds);
    row["memory"] = cell.peak_memory_bytes;
    row["ratio"] = json_number(cell.time_ratio);
  });
  return table("Seconds, " + results.suite.budgets[budget].label(), columns, rows);
}

Json slope_table(const Results& results) {
  Json columns = Json::array({column("scene", "Scene", "text")}), rows = Json::array();
  for (size_t m = 0; m < results.suite.methods.size(); ++m)
    columns.push_back(column(fmt::format("m{}", m), results.suite.methods[m].name, "number"));
  for (size_t s = 0; s < results.suite.scenes.size(); ++s) {
    Json row{{"scene", results.suite.scenes[s].name}};
    for (const Slope& slope : results.slopes)
      if (slope.scene == s) row[fmt::format("m{}", slope.method)] = value_of(slope.exponent);
    if (row.size() > 1) rows.push_back(std::move(row));
  }
  return table("Exponent of relMSE against samples; −1 is a method without bias", columns, rows);
}

Json convergence_plot(const Results& results, size_t scene) {
  const std::string& name = results.suite.scenes[scene].name;
  Json series = error_series(results, scene, true, [](const Cell& cell) { return cell.samples_per_pixel; });
  const std::string alt = alternative("relMSE of " + name + " from the fewest to the most samples", series);
  return plot(name, "samples per pixel", std::move(series), alt);
}

Json time_plot(const Results& results, size_t scene) {
  const std::string& name = results.suite.scenes[scene].name;
  const bool in_samples = std::ranges::count_if(results.suite.budgets, [](const Budget& b) { return b.spp > 0; }) > 1;
  Json series = error_series(results, scene, in_samples, [](const Cell& c) { return c.method_seconds.value; });
  const std::string alt = alternative("relMSE of " + name + " from the shortest to the longest time", series);
  return plot(name, "seconds, render and estimate", std::move(series), alt);
}

Json frames_table(const Results& results, size_t budget) {
  const Json columns{column("scene", "Scene", "text"),
                     column("method", "Method", "text"),
                     column("temporal", "Temporal error", "number"),
                     column("gain", "Gain", "ratio"),
                     column("flip", "Temporal FLIP", "number"),
                     column("worst_relmse", "Worst region, relMSE", "ratio"),
                     column("worst_temporal", "temporal", "ratio"),
                     column("frame_relmse", "Of a frame, relMSE", "ratio"),
                     column("frame_temporal", "temporal", "ratio")};
  Json rows = cell_rows(
      results, budget,
      [](const Cell& cell, Json& row) {
        row["temporal"] = value_of(cell.temporal);
        row["gain"] = value_of(cell.temporal_gain);
        row["flip"] = value_of(cell.temporal_flip);
        if (!cell.worst) return;
        row["worst_relmse"] = json_number(cell.worst->relmse.ratio);
        row["worst_temporal"] = json_number(cell.worst->temporal.ratio);
        row["frame_relmse"] = json_number(cell.worst->relmse_of_frame.ratio);
        row["frame_temporal"] = json_number(cell.worst->temporal_of_frame.ratio);
      },
      [](const Cell& cell) { return !cell.frames.empty(); });
  return table(fmt::format("Changes from frame to frame, {}; gain: error of {} / error of the method; worst region: "
                           "the largest error of the method / error of {} in a region of {} × {} pixels",
                           results.suite.budgets[budget].label(), results.suite.baseline, results.suite.baseline,
                           kRegionSide, kRegionSide),
               columns, rows);
}

Json frames_plot(const Results& results, size_t scene, size_t budget, bool of_changes) {
  const std::string title =
      fmt::format("{}, {}", results.suite.scenes[scene].name, results.suite.budgets[budget].label());
  Json series = Json::array();
  for (size_t m = 0; m < results.suite.methods.size(); ++m) {
    const Cell* cell = results.find(scene, m, budget);
    if (!cell) continue;
    Json x = Json::array(), y = Json::array();
    for (size_t f = 0; f < cell->frames.size(); ++f)
      if (const double error = of_changes ? cell->frames[f].temporal : cell->frames[f].relmse; error > 0) {
        x.push_back(results.scenes[scene].scene.frames[f]);
        y.push_back(error);
      }
    if (!x.empty()) series.push_back({{"name", results.suite.methods[m].name}, {"x", x}, {"y", y}, {"style", "line"}});
  }
  const char* what = of_changes ? "temporal error" : "relMSE";
  const std::string alt = alternative(fmt::format("{} of {} from the first to the last frame", what, title), series);
  return plot(title, "frame", std::move(series), alt, {{"label", what}, {"scale", "log"}}, "linear");
}

Json front_plot(const Results& results, size_t budget) {
  const Suite& suite = results.suite;
  const auto n_scenes = std::count_if(results.cells.begin(), results.cells.end(), [&](const Cell& cell) {
    return cell.budget == budget && suite.methods[cell.method].name == suite.baseline;
  });
  Json series = Json::array();
  std::string alt;
  for (size_t m = 0; m < suite.methods.size(); ++m) {
    std::vector<double> gains;
    double share = 0, square = 0;
    for (const Cell& cell : results.cells) {
      const SplitError& split = cell.split.relative;
      if (cell.method != m || cell.budget != budget || !std::isfinite(split.squared_bias.value / split.error.value) ||
          !std::isfinite(cell.equal_sample.value))
        continue;
      gains.push_back(cell.equal_sample.value);
      share += split.squared_bias.value / split.error.value;
      const double width = (split.squared_bias.high - split.squared_bias.low) / 2 / split.error.value;
      square += width * width;  // NaN with two seeds, which give no interval
    }
    // Means over fewer scenes are not comparable.
    if (gains.empty() || static_cast<ptrdiff_t>(gains.size()) < n_scenes) continue;
    const auto n = static_cast<double>(gains.size());
    const double error = 1 / geometric_mean(gains);
    share /= n;
    const double width = std::sqrt(square) / n;
    series.push_back({{"name", suite.methods[m].name},
                      {"x", {error}},
                      {"y", {share}},
                      {"low", {json_number(share - width)}},
                      {"high", {json_number(share + width)}},
                      {"style", "points"}});
    alt += fmt::format("{}{}: {:.3g}, {:.0f} %", alt.empty() ? "" : "; ", suite.methods[m].name, error, 100 * share);
  }
  return plot("Error against bias, " + suite.budgets[budget].label(), "relMSE / relMSE of " + suite.baseline,
              std::move(series), "Error relative to the baseline and share of squared bias: " + alt,
              {{"label", "squared bias / own relMSE"}, {"scale", "linear"}});
}

}  // namespace covary::lab
