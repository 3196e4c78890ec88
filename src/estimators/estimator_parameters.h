// SPDX-License-Identifier: Apache-2.0
// Options of an estimator, by name and as text, and typed access to them. An estimator is made from EstimatorParameters
// only: what it asks for is the list of its options, with the values of its options struct as defaults.
#pragma once

#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace covary {

/// Numbers that an option takes.
struct OptionRange {
  double low = -std::numeric_limits<double>::infinity(), high = std::numeric_limits<double>::infinity();
  bool odd = false;        ///< odd numbers only
  bool above_low = false;  ///< `low` itself is not one of them

  bool contains(double value) const;
  /// "odd, 3 to 63", "above 0"; empty where all numbers are.
  std::string text() const;
};

/// What is known of one option.
struct EstimatorOption {
  enum class Type { kFlag, kWhole, kReal, kChoice };
  std::string name;                  ///< without dashes: "pilot-window"
  std::vector<std::string> aliases;  ///< other names
  Type type = Type::kFlag;
  std::string default_value;  ///< as text; empty for flags, which are off, and where there is none
  OptionRange range;          ///< of numbers
  std::vector<std::string> choices;
  std::string help;
};

/// Values as given, by name (no alias) without dashes; of a flag any text. What is not there has its default.
using OptionValues = std::map<std::string, std::string>;

/// Names of a choice and what they stand for.
template <typename T>
using Choices = std::span<const std::pair<const char*, T>>;

class EstimatorParameters {
 public:
  explicit EstimatorParameters(OptionValues values = {}) : values_(std::move(values)) {}

  /// Whether the flag was given.
  bool flag(const std::string& name, const std::string& help);
  /// Each of these sets `value` where the option was given; before the call it holds the default. Throws Error(kUsage)
  /// for text that is no such value. The range is described here and checked with all else by the options' validate().
  void whole(const std::string& name, int& value, const OptionRange& range, const std::string& help);
  void real(const std::string& name, float& value, const OptionRange& range, const std::string& help);
  /// The same for options without a default.
  void whole(const std::string& name, std::optional<int>& value, const OptionRange& range, const std::string& help,
             const std::vector<std::string>& aliases = {});
  void real(const std::string& name, std::optional<float>& value, const OptionRange& range, const std::string& help);
  template <typename T>
  void choice(const std::string& name, T& value, Choices<T> choices, const std::string& help,
              const std::vector<std::string>& aliases = {}) {
    std::vector<std::string> names;
    size_t chosen = 0;
    for (const auto& [text, meaning] : choices) {
      if (meaning == value) chosen = names.size();
      names.emplace_back(text);
    }
    value = choices[choose(name, aliases, names, chosen, help)].second;
  }

  /// For options that were asked for and that other options decide on: unless `applies`, they change nothing, and
  /// giving one of them throws Error(kUsage) "--NAME has no effect WHY", e.g. "with --penalty sample: …".
  void only_if(bool applies, std::span<const char* const> names, const std::string& why) const;
  void only_if(bool applies, std::initializer_list<const char*> names, const std::string& why) const {
    only_if(applies, std::span(names.begin(), names.size()), why);
  }
  /// All that were asked for, in this order.
  const std::vector<EstimatorOption>& options() const { return options_; }

 private:
  /// The text given, or null.
  const std::string* find(const EstimatorOption& option) const;
  size_t choose(const std::string& name, const std::vector<std::string>& aliases, const std::vector<std::string>& names,
                size_t standard, const std::string& help);

  OptionValues values_;
  std::vector<EstimatorOption> options_;
};

}  // namespace covary
