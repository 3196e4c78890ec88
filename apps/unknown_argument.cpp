// SPDX-License-Identifier: Apache-2.0
#include "unknown_argument.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <vector>

#include "core/error.h"
#include "method_options.h"

namespace covary {
namespace {

/// Long options of `command` that `given` may mean, misspelt or abbreviated. Compared without dashes, which would make
/// all short names similar.
std::vector<std::string> near_options(const CLI::App& command, const std::string& given) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options())
    names.insert(names.end(), option->get_lnames().begin(), option->get_lnames().end());
  const std::string bare = given.substr(std::min(given.find_first_not_of('-'), given.size()));
  if (bare.size() < 2) return {};  // every short name is similar to a single letter
  std::vector<std::string> near = nearest_names(bare, names);
  if (near.empty())
    std::copy_if(names.begin(), names.end(), std::back_inserter(near), [&](auto& n) { return n.starts_with(bare); });
  for (std::string& name : near) name.insert(0, "--");
  return near;
}

}  // namespace

std::string unknown_argument(const CLI::App& command, const std::string& name) {
  const std::vector<std::string> extras = command.remaining(true);
  if (extras.empty()) return "";
  const auto option = std::ranges::find_if(extras, [](const std::string& word) { return word.starts_with('-'); });
  const std::string found = option == extras.end() ? extras[0] : *option, extra = found.substr(0, found.find('='));
  const std::string help = "; see '" + name + " --help'";
  if (!extra.starts_with('-')) return "too many arguments, beginning with '" + extra + "'" + help;
  if (const std::string present =
          present_form(extra.substr(std::min(extra.find_first_not_of('-'), extra.size())), command);
      !present.empty())
    return fmt::format("unknown option '{}': write {}{}", extra, present, help);
  const std::vector<std::string> near = near_options(command, extra);
  const std::string question = near.empty() ? "" : fmt::format("; did you mean '{}'?", fmt::join(near, "' or '"));
  return "unknown option '" + extra + "'" + (question.empty() ? help : question + " See" + help.substr(5));
}

}  // namespace covary
