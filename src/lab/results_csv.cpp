// SPDX-License-Identifier: Apache-2.0
// Results as CSV in long format: one row per number in their JSON.
#include <fmt/format.h>

#include "lab/results.h"

namespace covary::lab {
namespace {

using Json = nlohmann::ordered_json;

/// RFC 4180: quoted if it contains a comma, a quote or a line break.
std::string field(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string quoted = "\"";
  for (char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

std::string number(const Json& value) { return value.is_number() ? fmt::format("{}", value.get<double>()) : ""; }

/// One row for each number below `json`, named by its path, "seconds_load", and 1 for each true boolean.
void add_rows(const std::string& prefix, const std::string& quantity, const Json& json, std::string& text) {
  if (json.is_number()) text += fmt::format("{}{},{},,,\n", prefix, quantity, number(json));
  if (json.is_boolean() && json.get<bool>()) text += fmt::format("{}{},1,,,\n", prefix, quantity);
  if (!json.is_object()) return;
  const bool is_estimate = json.contains("standard_error");
  if (is_estimate && json["value"].is_number())
    text += fmt::format("{}{},{},{},{},{}\n", prefix, quantity, number(json["value"]), number(json["standard_error"]),
                        number(json["low"]), number(json["high"]));
  for (const auto& [key, value] : json.items()) {
    const bool is_known = key == "seed" || key == "budget" ||
                          (is_estimate && (key == "value" || key == "standard_error" || key == "low" || key == "high"));
    if (!is_known) add_rows(prefix, quantity.empty() ? key : quantity + "_" + key, value, text);
  }
}

}  // namespace

std::string to_csv(const Json& results) {
  std::string text = "scene,method,budget,unit,seed,quantity,value,standard_error,low,high\n";
  for (const Json& cell : results["cells"]) {
    const auto budget = cell["budget"].begin();
    const std::string of_cell = fmt::format("{},{},{},{},", field(cell["scene"].get<std::string>()),
                                            field(cell["method"].get<std::string>()), budget->dump(), budget.key());
    add_rows(of_cell + ",", "", cell, text);
    for (const Json& run : cell["runs"]) add_rows(of_cell + run["seed"].dump() + ",", "", run, text);
  }
  return text;
}

}  // namespace covary::lab
