// SPDX-License-Identifier: Apache-2.0
#include "suite_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "commands.h"
#include "value_names.h"

namespace covary {
namespace {

using Words = std::vector<std::string>;

// Placeholders for the files that an experiment adds to the command.
constexpr const char *kInputWord = "the-input-of-the-experiment", *kOutputWord = "the-output-of-the-experiment";

/// What a value with this placeholder names outside the suite; null for plain values.
const char* what_is_named(const std::string& name) {
  static constexpr std::pair<const char*, const char*> kOutside[] = {{kFileValue, "a file"},
                                                                     {kFolderValue, "a folder"},
                                                                     {kLibraryValue, "a library"},
                                                                     {kServerValue, "a server"},
                                                                     {"TEXT", "something outside"}};
  for (const auto& [value, what] : kOutside)
    if (name == value) return what;
  return nullptr;
}

/// The alternatives of "off|LIBRARY".
Words alternatives(const std::string& type) {
  Words names;
  size_t at = 0;
  for (size_t bar; (bar = type.find('|', at)) != std::string::npos; at = bar + 1)
    names.push_back(type.substr(at, bar - at));
  names.push_back(type.substr(at));
  return names;
}

/// What the option's value names outside the suite; null if nothing.
const char* named_by(const CLI::Option& option, const std::string& value) {
  if (option.get_items_expected_max() == 0 || option.get_positional()) return nullptr;  // positionals are read
  const Words names = alternatives(option.get_type_name());
  if (std::find(names.begin(), names.end(), value) != names.end() && !what_is_named(value)) return nullptr;
  for (const std::string& name : names)
    if (const char* what = what_is_named(name)) return what;
  return nullptr;
}

/// The word with the option; the first if it cannot be determined.
size_t word_of(const CLI::Option& option, const Words& words) {
  const auto gives = [&](const std::string& word) {
    for (const std::string& name : option.get_lnames())
      if (word == "--" + name || word.starts_with("--" + name + "=")) return true;
    return std::any_of(option.get_snames().begin(), option.get_snames().end(),
                       [&](const std::string& name) { return word.starts_with("-" + name); });
  };
  const auto found = std::find_if(words.begin() + 1, words.end(), gives);
  return found == words.end() ? 0 : static_cast<size_t>(found - words.begin());
}

std::vector<lab::WordProblem> problems_of(const CLI::App& command, const Words& words) {
  std::vector<lab::WordProblem> problems;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& value : option->results()) {
      const bool is_ours = option->check_lname("output") && value == kOutputWord;
      const char* what = is_ours ? nullptr : named_by(*option, value);
      if (!what) continue;
      const size_t word = word_of(*option, words);
      problems.push_back({word, fmt::format("{} '{}' names {}, which a suite may not; options of suites are flags, "
                                            "numbers and choices{}",
                                            words[word].substr(0, words[word].find('=')), value, what,
                                            option->check_lname("oidn") ? ", and '--oidn off'" : "")});
    }
  return problems;
}

/// Thrown once all options are read, before anything is done.
struct Parsed {};

}  // namespace

std::vector<lab::WordProblem> check_suite_command(const Words& command) {
  CLI::App app("", "covary");
  app.require_subcommand(0, 1);
  add_commands(app);
  app.parse_complete_callback([] { throw Parsed(); });
  Words words = {command[0], kInputWord};
  words.insert(words.end(), command.begin() + 1, command.end());
  const bool is_render = command[0] == "render";
  if (!is_render) words.insert(words.end(), {"-o", kOutputWord});
  std::reverse(words.begin(), words.end());
  std::vector<lab::WordProblem> refused;
  try {
    app.parse(words);
  } catch (const CLI::Error& error) {
    if (!is_render) refused = {{0, error.what()}};  // `experiment` reports those of renders
  } catch (const Parsed&) {
  }
  if (app.get_subcommands().empty()) return refused;
  const std::vector<lab::WordProblem> problems = problems_of(*app.get_subcommands()[0], command);
  return problems.empty() ? refused : problems;
}

}  // namespace covary
