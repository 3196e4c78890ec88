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
// The function reads values wherever they were given (command line, properties in a scene file, Python arguments);
// where none are given it only lists the options, with the values in the struct as defaults. Everything else reads that
// list: command line, help, man page, completion, validation, the settings text stored in films, the command that
// replays a sample, the options that a suite may use, Python, and the tests of the documentation.
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

/// Names of a choice and the values they stand for.
template <typename T>
using Choices = std::span<const std::pair<const char*, T>>;

/// Less common properties of an option; see Option.
struct OptionTraits {
  std::string letter = {};
  OptionLevel level = OptionLevel::kExpert;
  OptionNames names = OptionNames::kValue;
  OptionEffect effect = OptionEffect::kImage;  ///< raised to the effect of the group if that is larger
  std::string film = {};                       ///< see Settings::film_text()
};

/// A word that is accepted in place of a number: "auto" for `value`.
template <typename T>
struct NumberWord {
  const char* word;
  T value;
};

/// Source of option values.
class SettingsSource {
 public:
  virtual ~SettingsSource() = default;
  /// The value as text; nullopt if not given.
  virtual std::optional<std::string> find(const Option& option) = 0;
  /// Whether the value was given by the caller, who expects it to have an effect, rather than by a file.
  virtual bool is_of_caller(const Option& option) = 0;
  /// From here on, ignores values that are not the caller's.
  virtual void leave_out_others() {}
  /// Reports a value that was not accepted: throws, or records the problem and the setting keeps its value.
  virtual void refuse(const Option& option, const std::string& problem) = 0;
};

class Settings {
 public:
  /// Reads texts. Throws Error(kUsage) "`NAME` 'x': expected …" for a text that is not a value or out of range.
  explicit Settings(OptionValues values = {});
  explicit Settings(SettingsSource& source) : source_(&source) {}
  ~Settings();
  Settings(const Settings&) = delete;
  Settings& operator=(const Settings&) = delete;

  /// Heading in the help for the following options, and the least effect of all of them.
  void group(const std::string& heading, OptionEffect effect = OptionEffect::kImage) {
    group_ = heading, effect_ = effect;
  }

  /// Whether an option declared later has been given, for defaults that depend on it.
  bool is_given(const std::string& name);

  /// Whether a flag, declared later, that sets many options at once was given. If the caller gave it, values from files
  /// are ignored.
  bool preset(const std::string& name);

  /// Declares a flag; returns whether it was given.
  bool flag(const std::string& name, const std::string& help, const OptionTraits& traits = {});
  void flag(const std::string& name, bool& value, const std::string& help, const OptionTraits& traits = {}) {
    if (flag(name, help, traits)) value = true;
    set_value(value ? "on" : "");
  }
  /// Each of these declares an option and sets `value` if it was given; on entry `value` is the default, which may be
  /// absent if it is an optional.
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
  /// A choice among names known only at run time; the default may be none of them.
  void one_of(const std::string& name, std::string& value, const std::vector<std::string>& names,
              const std::string& help, const OptionTraits& traits = {});
  /// Any text; `form` describes its format.
  void text(const std::string& name, std::string& value, const std::string& form, const std::string& help,
            const OptionTraits& traits = {});
  /// A text parsed by `read(text, value)`, which returns "" on success and otherwise what was expected.
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
  /// One or more texts each time the option is given.
  void texts(const std::string& name, std::vector<std::string>& values, const std::string& form,
             const std::string& help, const OptionTraits& traits = {});

  /// Declares that options above depend on others: unless `applies`, they have no effect, and giving one of them throws
  /// Error(kUsage) "--NAME has no effect WHY", e.g. "with --penalty sample: …".
  void only_if(bool applies, std::span<const char* const> names, const std::string& why);
  void only_if(bool applies, std::initializer_list<const char*> names, const std::string& why) {
    only_if(applies, std::span(names.begin(), names.size()), why);
  }

  /// All options in order of declaration; the default is the current value.
  const std::vector<Option>& options() const { return options_; }

  /// The settings text stored in films, "grid=8 paper": for each option that has an effect and a `film` format, that
  /// format with its value ("grid={}"), or, if it has no placeholder ("paper"), the word itself if the option is on.
  /// Equal text means equal settings.
  std::string film_text() const;

 private:
  /// Adds the option. Returns its text if given and valid.
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

/// The options of a struct that has a declare(), with the given values as defaults.
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
