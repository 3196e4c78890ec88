// SPDX-License-Identifier: Apache-2.0
// The integrators by name, and the tables of their options in docs/scene-format.md.
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <map>

#include "integrators/registry.h"
#include "settings/option_names.h"

namespace covary {
namespace {

std::string values_of(const Option& option) {
  if (option.type == Option::Type::kFlag || option.is_switch()) return "boolean";
  if (option.type == Option::Type::kChoice) return fmt::format("{}", fmt::join(option.choices, ", "));
  OptionRange bounds = option.range;
  if (bounds.high >= 1 << 30) bounds.high = std::numeric_limits<double>::infinity();
  const std::string range = bounds.text(), words = fmt::format("{}", fmt::join(option.choices, ", "));
  return fmt::format("{}{}{}{}", words, words.empty() ? "" : " or ",
                     option.type == Option::Type::kWhole ? "integer" : "float", range.empty() ? "" : ", " + range);
}

std::string row_of(const Option& option) {
  std::string standard = option.default_value;
  if (values_of(option) == "boolean") standard = standard == "on" ? "true" : "false";
  return fmt::format("| `{}` | {} | {} | {} |\n", underscored(option.name), values_of(option), standard,
                     as_arguments(option.help));
}

/// Below the heading of each integrator, the page has a row for each of its options, and no others; common options are
/// listed with `path`.
TEST(IntegratorRegistry, IsDocumented) {
  const std::vector<Option> of_path = options_of_integrator("path");
  std::map<std::string, std::string> expected, found;
  for (const std::string& name : integrator_names())
    for (const Option& option : options_of_integrator(name))
      if (name == "path" || !find_option(of_path, option.name)) expected["### `" + name + "`"] += row_of(option);
  std::ifstream file(std::string(COVARY_SOURCE_DIR) + "/docs/scene-format.md");
  std::string line, heading;
  while (std::getline(file, line) && line != "## Integrators (`integrators`)") {
  }
  while (std::getline(file, line) && !line.starts_with("## ")) {
    if (line.starts_with("### `")) heading = line;
    if (line.starts_with("| `")) found[heading] += line + "\n";
  }
  EXPECT_EQ(found, expected);
}

}  // namespace
}  // namespace covary
