// SPDX-License-Identifier: Apache-2.0
// Settings declared once. A component declares its options in one function over its settings struct:
//
//   void declare(Settings& s, FogSettings& v) {
//     s.group("Fog");
//     s.whole("fog-steps", v.steps, {.low = 1, .high = 64}, "Steps of each ray");
//     s.on_off("fog-jitter", v.jitter, "Whether steps begin at random", {.effect = OptionEffect::kSamples});
//     s.only_if(v.steps > 1, {"fog-jitter"}, "with --fog-steps 1");
//   }
//
// The function reads values wherever they were given (words of the command line, properties of a scene file, arguments
// in Python) and, where none is given, only lists the options, with the values of the struct as defaults. Everything
// else reads the list: command line, help, man page, completion, checks, the text of settings in films, the command
// that repeats a sample, the options that a suite may use, Python, and the tests of the documentation.
#pragma once

#include <charconv>
#include <initializer_list>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "settings/option.h"

namespace covary {

/// Names of a choice and what they stand for.
template <typename T>
using Choices = std::span<const std::pair<const char*, T>>;

/// What is seldom said of an option; Option says what each means.
struct OptionTraits {
  std::vector<std::string> aliases = {};
  OptionLevel level = OptionLevel::kExpert;
  OptionNames names = OptionNames::kValue;
  OptionEffect effect = OptionEffect::kImage;  ///< the group's where that is more
  std::string film = {};                       ///< see Settings::film_text()
};

/// A number that may be a word: "auto" for `value`.
template <typename T>
struct NumberWord {
  const char* word;
  T value;
};

/// Where values come from.
class SettingsSource {
 public:
  virtual ~SettingsSource() = default;
  /// The value as text, or nothing where none is given.
  virtual std::optional<std::string> find(const Option& option) = 0;
  /// Whether the value is one of the caller's, who expects an effect, and not one that lies in a file.
  virtual bool is_of_caller(const Option& option) = 0;
  /// From here on, only values of the caller's count.
  virtual void leave_out_others() {}
  /// A value that is not accepted, with what is; either throws, or takes note of it, and the setting keeps its value.
  virtual void refuse(const Option& option, const std::string& problem) = 0;
  /// Whether ranges of numbers are checked as values are read; otherwise by the settings' own validate().
  virtual bool checks_ranges() const { return true; }
};

class Settings {
 public:
  /// Reads texts. Throws Error(kUsage) "--NAME 'x': expected …" for a text that is no such value; ranges are described
  /// here, and checked with all else by the validate() of the settings struct.
  explicit Settings(OptionValues values = {});
  explicit Settings(SettingsSource& source) : source_(&source) {}
  ~Settings();
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  /// Heading in the help of the options that follow, and what all of them change.
  void group(const std::string& heading, OptionEffect effect = OptionEffect::kImage) {
    group_ = heading, effect_ = effect;
  }

  /// Whether an option has a value that is yet to be declared, for defaults that depend on it.
  bool is_given(const std::string& name);

  /// Whether a flag that is yet to be declared was given which sets many options at once. A caller's takes the place of
  /// all that a file says.
  bool preset(const std::string& name);

  /// Whether the flag was given.
  bool flag(const std::string& name, const std::string& help, const OptionTraits& traits = {});
  void flag(const std::string& name, bool& value, const std::string& help, const OptionTraits& traits = {}) {
    if (flag(name, help, traits)) value = true;
    set_value(value ? "on" : "");
  }
  /// Each of these sets `value` where the option was given; before the call it holds the default, which an optional may
  /// lack.
  void on_off(const std::string& name, bool& value, const std::string& help, const OptionTraits& traits = {});
  template <typename T>
  void whole(const std::string& name, T& value, const OptionRange& range, const std::string& help,
             const OptionTraits& traits = {}) {
    number(Option::Type::kWhole, name, value, range, help, traits);
  }
  template <typename T>
  void whole(const std::string& name, T& value, const OptionRange& range, const NumberWord<T>& word,
             const std::string& help, const OptionTraits& traits = {}) {
    number_or_word(Option::Type::kWhole, name, value, range, word, help, traits);
  }
  template <typename T>
  void real(const std::string& name, T& value, const OptionRange& range, const std::string& help,
            const OptionTraits& traits = {}) {
    number(Option::Type::kReal, name, value, range, help, traits);
  }
  template <typename T>
  void real(const std::string& name, T& value, const OptionRange& range, const NumberWord<T>& word,
            const std::string& help, const OptionTraits& traits = {}) {
    number_or_word(Option::Type::kReal, name, value, range, word, help, traits);
  }
  template <typename T>
  void choice(const std::string& name, T& value, Choices<std::type_identity_t<T>> choices, const std::string& help,
              const OptionTraits& traits = {}) {
    std::vector<std::string> names;
    size_t chosen = choices.size();
    for (const auto& [text, meaning] : choices) {
      if (meaning == value) chosen = names.size();
      names.emplace_back(text);
    }
    const size_t now = choose(name, names, chosen, help, traits);
    if (now < choices.size()) value = choices[now].second;
  }
  /// One of names that are known when the program runs; the default may be a text that is none of them.
  void one_of(const std::string& name, std::string& value, const std::vector<std::string>& names,
              const std::string& help, const OptionTraits& traits = {});
  /// Any text; `form` says what it looks like.
  void text(const std::string& name, std::string& value, const std::string& form, const std::string& help,
            const OptionTraits& traits = {});
  /// A text that `read(text, value)` understands; it returns what was expected otherwise, or an empty text.
  template <typename T, typename Read>
  void text_as(const std::string& name, T& value, const std::string& form, const Read& read, const std::string& help,
               const OptionTraits& traits = {}) {
    Option option = made(Option::Type::kText, name, help, traits);
    option.form = form;
    const std::optional<std::string> given = declare(std::move(option));
    if (!given) return;
    const std::string problem = read(*given, value);
    if (!problem.empty()) source_->refuse(options_.back(), "'" + *given + "': expected " + problem);
    set_value(*given);
  }
  /// Texts, one or more each time the option is given.
  void texts(const std::string& name, std::vector<std::string>& values, const std::string& form,
             const std::string& help, const OptionTraits& traits = {});

  /// For options that were declared and that other options decide on: unless `applies`, they change nothing, and giving
  /// one of them throws Error(kUsage) "--NAME has no effect WHY", e.g. "with --penalty sample: …".
  void only_if(bool applies, std::span<const char* const> names, const std::string& why);
  void only_if(bool applies, std::initializer_list<const char*> names, const std::string& why) {
    only_if(applies, std::span(names.begin(), names.size()), why);
  }

  /// All that were declared, in this order; the default is the value now.
  const std::vector<Option>& options() const { return options_; }

  /// The settings as films keep them, "grid=8 paper": of each option with an effect and a `film`, that format with its
  /// value ("grid={}"), or where it has no place for one ("paper"), the word where the value is "on". Equal text, equal
  /// settings.
  std::string film_text() const;

 private:
  /// Adds the option. The text given, or nothing where there is none that is right.
  std::optional<std::string> declare(Option option);
  Option made(Option::Type type, const std::string& name, const std::string& help, const OptionTraits& traits) const;
  size_t choose(const std::string& name, const std::vector<std::string>& names, size_t standard,
                const std::string& help, const OptionTraits& traits);
  void set_value(std::string text) { options_.back().default_value = std::move(text); }

  template <typename T>
  requires std::is_arithmetic_v<T>
  static std::string number_text(T value) {
    if constexpr (std::is_floating_point_v<T>) {
      char digits[64];
      return {digits, std::to_chars(digits, digits + sizeof digits, value).ptr};
    } else {
      return std::to_string(value);
    }
  }
  template <typename T>
  static std::string number_text(const std::optional<T>& value) {
    return value ? number_text(*value) : "";
  }
  template <typename T>
  static void parse(const std::string& text, T& value) {
    std::from_chars(text.data(), text.data() + text.size(), value);
  }
  template <typename T>
  static void parse(const std::string& text, std::optional<T>& value) {
    parse(text, value.emplace());
  }
  template <typename T>
  struct Bare {
    using Type = T;
  };
  template <typename T>
  struct Bare<std::optional<T>> {
    using Type = T;
  };

  template <typename T>
  static void set_limits(Option& option) {
    if constexpr (std::is_integral_v<T>) {
      option.least = std::is_signed_v<T> ? static_cast<int64_t>(std::numeric_limits<T>::lowest()) : 0;
      option.most = static_cast<uint64_t>(std::numeric_limits<T>::max());
    }
  }

  template <typename T>
  void number(Option::Type type, const std::string& name, T& value, const OptionRange& range, const std::string& help,
              const OptionTraits& traits) {
    Option option = made(type, name, help, traits);
    option.range = range;
    set_limits<typename Bare<T>::Type>(option);
    option.default_value = number_text(value);
    if (const std::optional<std::string> given = declare(std::move(option))) {
      parse(*given, value);
      set_value(number_text(value));
    }
  }
  template <typename T>
  void number_or_word(Option::Type type, const std::string& name, T& value, const OptionRange& range,
                      const NumberWord<T>& word, const std::string& help, const OptionTraits& traits) {
    Option option = made(type, name, help, traits);
    option.range = range;
    set_limits<T>(option);
    option.choices = {word.word};
    option.default_value = value == word.value ? word.word : number_text(value);
    if (const std::optional<std::string> given = declare(std::move(option))) {
      if (*given == word.word)
        value = word.value;
      else
        parse(*given, value);
      set_value(value == word.value ? word.word : *given);
    }
  }

  std::unique_ptr<SettingsSource> own_source_;
  SettingsSource* source_ = nullptr;
  std::string group_;
  OptionEffect effect_ = OptionEffect::kImage;
  std::vector<Option> options_;
};

/// The options of a struct that has a declare(), and what values make of it.
template <typename T>
std::vector<Option> options_of(T settings = {}) {
  Settings list;
  declare(list, settings);
  return list.options();
}
template <typename T>
T settings_from(const OptionValues& values, T settings = {}) {
  Settings reader(values);
  declare(reader, settings);
  return settings;
}

/// Settings::film_text() of a struct that has a declare().
template <typename T>
std::string film_text_of(T settings) {
  Settings list;
  declare(list, settings);
  return list.film_text();
}

}  // namespace covary
