// SPDX-License-Identifier: Apache-2.0
// Results as CSV in long format: one number a row.
#include <fmt/format.h>

#include <cmath>

#include "lab/results.h"

namespace covary::lab {
namespace {

/// RFC 4180: quoted where it holds a comma, a quote or a line break.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : ""; }

class Table {
 public:
  Table() : text_("scene,method,budget,unit,seed,quantity,value,standard_error,low,high\n") {}
  void begin(const std::string& scene, const std::string& method, const Budget& budget, const std::string& seed) {
    prefix_ = fmt::format("{},{},{},{},{},", field(scene), field(method), budget.spp ? budget.spp : budget.seconds,
                          budget.spp ? "spp" : "seconds", seed);
  }
  /// Quantities that do not exist leave no row.
  void add(const std::string& quantity, const Estimate& e) {
    if (!std::isfinite(e.value)) return;
    text_ += fmt::format("{}{},{},{},{},{}\n", prefix_, quantity, number(e.value), number(e.standard_error),
                         number(e.low), number(e.high));
  }
  void add(const std::string& quantity, double value) { add(quantity, Estimate{value, kNone, kNone, kNone}); }
  const std::string& text() const { return text_; }

 private:
  std::string text_, prefix_;
};

void add_cell(Table& table, const Cell& cell) {
  table.add("relmse", cell.split.relative.error);
  table.add("relmse_squared_bias", cell.split.relative.squared_bias);
  table.add("relmse_variance", cell.split.relative.variance);
  table.add("mse", cell.split.absolute.error);
  table.add("mse_squared_bias", cell.split.absolute.squared_bias);
  table.add("mse_variance", cell.split.absolute.variance);
  table.add("relmse_trimmed", cell.relmse_trimmed);
  table.add("mae", cell.mae);
  table.add("mae_of_mean", cell.mae_of_mean);
  table.add("flip", cell.flip);
  table.add("flip_of_mean", cell.flip_of_mean);
  table.add("above5", cell.above5);
  table.add("mean_ratio", cell.split.mean_ratio);
  table.add("equal_sample", cell.equal_sample);
  if (cell.equal_sample_normalised) table.add("equal_sample_normalised", 1);
  table.add("equal_time", cell.equal_time);
  table.add("efficiency", cell.efficiency);
  table.add("predicted_over_true", cell.predicted_over_true);
  table.add("coverage", cell.coverage);
  table.add("temporal", cell.temporal);
  table.add("temporal_flip", cell.temporal_flip);
  table.add("temporal_gain", cell.temporal_gain);
  if (cell.worst) {
    table.add("worst_region_relmse", cell.worst->relmse.ratio);
    table.add("worst_region_temporal", cell.worst->temporal.ratio);
  }
  table.add("bounded", cell.bounded);
  table.add("bounds_hold", cell.bounds_hold);
  table.add("published_relmse", cell.published_relmse);
  table.add("published_ratio", cell.published_ratio);
  table.add("seconds_load", cell.load_seconds);
  table.add("seconds_render", cell.render_seconds);
  table.add("seconds_estimate", cell.estimate_seconds);
  table.add("seconds_then", cell.then_seconds);
  table.add("seconds_method", cell.method_seconds);
  table.add("seconds_over_budget", cell.time_ratio);
  table.add("samples_per_pixel", cell.samples_per_pixel);
  table.add("peak_memory_bytes", cell.peak_memory_bytes);
}

void add_run(Table& table, const RunResult& run) {
  table.add("relmse", run.relmse);
  table.add("relmse_trimmed", run.relmse_trimmed);
  table.add("mse", run.mse);
  table.add("mae", run.mae);
  table.add("flip", run.flip);
  table.add("above5", run.above5);
  table.add("mean_ratio", run.mean_ratio);
  table.add("predicted_relmse", run.predicted_relmse);
  table.add("predicted_relmse_low", run.predicted_low);
  table.add("predicted_relmse_high", run.predicted_high);
  table.add("coverage", run.coverage);
  table.add("temporal", run.temporal);
  table.add("temporal_flip", run.temporal_flip);
  table.add("seconds_load", run.record.load_seconds);
  table.add("seconds_render", run.record.render_seconds);
  table.add("seconds_estimate", run.record.estimate_seconds);
  table.add("seconds_then", run.record.then_seconds);
}

}  // namespace

std::string to_csv(const Results& results) {
  const Suite& suite = results.suite;
  Table table;
  for (const Cell& cell : results.cells) {
    const std::string &scene = suite.scenes[cell.scene].name, &method = suite.methods[cell.method].name;
    table.begin(scene, method, suite.budgets[cell.budget], "");
    add_cell(table, cell);
    for (const RunResult& run : cell.runs) {
      table.begin(scene, method, suite.budgets[cell.budget], fmt::format("{}", run.seed));
      add_run(table, run);
    }
  }
  return table.text();
}

}  // namespace covary::lab
