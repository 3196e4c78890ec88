// SPDX-License-Identifier: Apache-2.0
// Description of one option: all that the command line, scene files, Python, help, man page, completion and the option
// tables of the documentation know about it. Options are declared through settings.h.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

/// Range of a numeric option.
struct OptionRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool odd = false;         ///< odd numbers only
  bool above_low = false;   ///< exclusive lower bound
  bool below_high = false;  ///< exclusive upper bound

  bool contains(double value) const;
  /// "odd, 3 to 63", "above 0"; empty if unbounded.
  std::string text() const;
};

/// What outside the render the option's text refers to. Suites from untrusted sources may use kValue only.
enum class OptionNames { kValue, kFile, kFolder, kLibrary, kServer };

/// What the option affects: only images made from films; which samples are taken; or the values of samples, in which
/// case the command that replays one needs it.
enum class OptionEffect { kImage, kPasses, kSamples };

/// Intended audience: everyone who wants a picture, or experts in the method; kScene: a property of scene files, not an
/// option of commands.
enum class OptionLevel { kBasic, kExpert, kScene };

struct Option {
  enum class Type { kFlag, kWhole, kReal, kChoice, kText };
  std::string name;    ///< without dashes: "pilot-window"; with '_' in scene files and Python
  std::string letter;  ///< "o" of -o; may be empty
  Type type = Type::kFlag;
  std::string default_value;  ///< as text; empty for flags, which are off, and if there is none
  OptionRange range;          ///< of numeric options
  int64_t least = std::numeric_limits<int64_t>::min();  ///< of whole numbers: the smallest value of the setting's type
  uint64_t most = std::numeric_limits<uint64_t>::max();
  std::vector<std::string> choices;  ///< of a choice; or words accepted in place of a number
  std::string form;                  ///< of text: "WIDTHxHEIGHT"
  std::string help;                  ///< one sentence without a full stop

  std::string group;  ///< heading in the help
  OptionLevel level = OptionLevel::kExpert;
  OptionNames names = OptionNames::kValue;
  OptionEffect effect = OptionEffect::kImage;
  bool repeats = false;    ///< can be given several times; values are separated by newlines
  std::string film;        ///< see Settings::film_text()
  bool has_effect = true;  ///< false if the values of other options make it irrelevant

  /// Whether the choices are exactly "on" and "off"; a boolean in scene files.
  bool is_switch() const;
  /// "a whole number from 1 to 4", "on or off", "WIDTHxHEIGHT".
  std::string expected() const;
};

/// Values as given, keyed by name without dashes; any text for a flag. Missing options have their defaults.
using OptionValues = std::map<std::string, std::string>;

/// The value in canonical form: numbers without plus sign or leading zeros. nullopt if `text` is not a valid value;
/// Texts pass unchecked: whoever parses them validates them.
std::optional<std::string> accepted(const Option& option, const std::string& text);
/// Error for a text that is not accepted: "'x': expected a number above 0".
std::string problem_of(const Option& option, const std::string& text);

const Option* find_option(const std::vector<Option>& options, std::string_view name);

/// Throws Error(kUsage) for an option that is not among `own`, the options of the `kind` ("estimator") called `owner`.
/// `others`: names of others of this kind that have the option.
[[noreturn]] void refuse_option(const std::string& kind, const std::string& owner, const std::vector<Option>& own,
                                const std::string& option, const std::vector<std::string>& others);

/// "cv-grid" as written in scene files and Python, "cv_grid"; and the reverse.
std::string underscored(std::string name);
std::string dashed(std::string name);

/// The given options as command-line arguments, in order of declaration.
std::vector<std::string> option_words(const std::vector<Option>& options, const OptionValues& values);

/// Splits the text of an option into its values, more than one if the option repeats.
std::vector<std::string> lines_of(const Option& option, const std::string& value);

/// Merges lists of options: options with equal names become one, whose help says where the lists differ. `owners`:
/// names of the lists, in order.
std::vector<Option> merged_options(const std::vector<std::string>& owners,
                                   const std::vector<std::vector<Option>>& lists);

/// The option's help followed by its default.
std::string help_with_default(const Option& option);

}  // namespace covary
