// SPDX-License-Identifier: Apache-2.0
// What is known of one option: all that command line, scene files, Python, help, man page, completion and the tables of
// the documentation say of it. Options are declared by settings.h.
#pragma once

#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace covary {

/// Numbers that an option takes.
struct OptionRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool odd = false;         ///< odd numbers only
  bool above_low = false;   ///< `low` itself is not one of them
  bool below_high = false;  ///< nor `high`

  bool contains(double value) const;
  /// "odd, 3 to 63", "above 0"; empty where all numbers are.
  std::string text() const;
};

/// What the text of an option names outside of the render. A suite from elsewhere may use values only.
enum class OptionNames { kValue, kFile, kFolder, kLibrary, kServer };

/// What a value changes: what is made of films alone; which samples are taken; or the values of samples, so that the
/// command that repeats one needs it.
enum class OptionEffect { kImage, kPasses, kSamples };

/// Who needs it: everybody who wants a picture, or those who know the method.
enum class OptionLevel { kBasic, kExpert };

struct Option {
  enum class Type { kFlag, kWhole, kReal, kChoice, kText };
  std::string name;                  ///< without dashes: "pilot-window"; in scene files and Python with '_'
  std::vector<std::string> aliases;  ///< other names; of one letter: "-o"
  Type type = Type::kFlag;
  std::string default_value;  ///< as text; empty for flags, which are off, and where there is none
  OptionRange range;          ///< of numbers
  int64_t least = std::numeric_limits<int64_t>::min();  ///< of whole numbers: what the setting can hold
  uint64_t most = std::numeric_limits<uint64_t>::max();
  std::vector<std::string> choices;  ///< of a choice; words that a number may be in place of one
  std::string form;                  ///< of a text: "WIDTHxHEIGHT"
  std::string help;                  ///< one sentence without its full stop

  std::string group;  ///< heading in the help
  OptionLevel level = OptionLevel::kExpert;
  OptionNames names = OptionNames::kValue;
  OptionEffect effect = OptionEffect::kImage;
  bool repeats = false;    ///< may have several values, which is a line for each of them
  std::string film;        ///< see Settings::film_text()
  bool has_effect = true;  ///< false where values of other options leave it without one

  /// Of exactly the words "on" and "off"; a boolean in scene files.
  bool is_switch() const;
  /// "a whole number from 1 to 4", "on or off", "WIDTHxHEIGHT".
  std::string expected() const;
};

/// Values as given, by name (no alias) without dashes; of a flag any text. What is not there has its default.
using OptionValues = std::map<std::string, std::string>;

/// The value as it is kept: numbers without a plus sign and zeros in front. Nothing where `text` is no value of the
/// option; with `in_range` false, ranges of numbers are left unchecked. Texts are what their readers accept.
std::optional<std::string> accepted(const Option& option, const std::string& text, bool in_range = true);
/// What is said of a text that is not accepted: "'x': expected a number above 0".
std::string problem_of(const Option& option, const std::string& text);

const Option* find_option(const std::vector<Option>& options, std::string_view name);

/// Throws Error(kUsage) of an option that is not among `own`: the options of the `kind` ("estimator") that is named
/// `owner`. `others`: names of those of this kind that have it.
[[noreturn]] void refuse_option(const std::string& kind, const std::string& owner, const std::vector<Option>& own,
                                const std::string& option, const std::vector<std::string>& others);

/// "cv-grid" as scene files and Python have it: "cv_grid". And back.
std::string underscored(std::string name);
std::string dashed(std::string name);

/// The options that were given as words of a command line, in the order of the declarations.
std::vector<std::string> option_words(const std::vector<Option>& options, const OptionValues& values);

/// The values of one text: several of an option that may be given more than once.
std::vector<std::string> lines_of(const Option& option, const std::string& value);

/// Lists of options as one: equal names are one option, whose help tells where lists differ. `owners`: names of the
/// lists, in their order.
std::vector<Option> merged_options(const std::vector<std::string>& owners,
                                   const std::vector<std::vector<Option>>& lists);

/// The help with the default.
std::string help_with_default(const Option& option);

}  // namespace covary
