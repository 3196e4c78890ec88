// SPDX-License-Identifier: Apache-2.0
#include "settings/settings.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "core/error.h"

namespace covary {
namespace {

/// Values by name.
class TextSource final : public SettingsSource {
 public:
  explicit TextSource(OptionValues values) : values_(std::move(values)) {}
  std::optional<std::string> find(const Option& option) override {
    const auto found = values_.find(option.name);
    return found == values_.end() ? std::nullopt : std::optional(found->second);
  }
  bool is_of_caller(const Option& option) override { return values_.contains(option.name); }
  void refuse(const Option& option, const std::string& problem) override {
    throw Error(ErrorCode::kUsage, fmt::format("`{}` {}", option.name, problem));
  }

 private:
  OptionValues values_;
};

}  // namespace

Settings::Settings(OptionValues values)
    : own_source_(std::make_unique<TextSource>(std::move(values))), source_(own_source_.get()) {}

Settings::~Settings() = default;

Option Settings::made(Option::Type type, const std::string& name, const std::string& help,
                      const OptionTraits& traits) const {
  Option option;
  option.name = name, option.type = type, option.help = help, option.group = group_;
  option.letter = traits.letter, option.level = traits.level, option.names = traits.names;
  option.effect = std::max(traits.effect, effect_), option.film = traits.film;
  return option;
}

std::optional<std::string> Settings::declare(Option option) {
  options_.push_back(std::move(option));
  const Option& declared = options_.back();
  const std::optional<std::string> given = source_->find(declared);
  if (!given) return {};
  std::optional<std::string> value = accepted(declared, *given);
  if (!value) source_->refuse(declared, problem_of(declared, *given));
  return value;
}

bool Settings::is_given(const std::string& name) {
  Option option;
  option.name = name;
  return source_->find(option).has_value();
}

bool Settings::preset(const std::string& name) {
  Option option;
  option.name = name;
  const std::optional<std::string> given = source_->find(option);
  if (!given || *given == "off") return false;
  if (source_->is_of_caller(option)) source_->leave_out_others();
  return true;
}

bool Settings::flag(const std::string& name, const std::string& help, const OptionTraits& traits) {
  const std::optional<std::string> given = declare(made(Option::Type::kFlag, name, help, traits));
  return given && *given != "off";
}

void Settings::on_off(const std::string& name, bool& value, const std::string& help, const OptionTraits& traits) {
  static constexpr std::pair<const char*, bool> kWords[] = {{"on", true}, {"off", false}};
  choice<bool>(name, value, kWords, help, traits);
}

size_t Settings::choose(const std::string& name, const std::vector<std::string>& names, size_t standard,
                        const std::string& help, const OptionTraits& traits) {
  Option option = made(Option::Type::kChoice, name, help, traits);
  option.choices = names;
  if (standard < names.size()) option.default_value = names[standard];
  const std::optional<std::string> given = declare(std::move(option));
  if (!given) return standard;
  set_value(*given);
  return static_cast<size_t>(std::find(names.begin(), names.end(), *given) - names.begin());
}

void Settings::one_of(const std::string& name, std::string& value, const std::vector<std::string>& names,
                      const std::string& help, const OptionTraits& traits) {
  Option option = made(Option::Type::kChoice, name, help, traits);
  option.choices = names, option.default_value = value;
  if (const std::optional<std::string> given = declare(std::move(option))) set_value(value = *given);
}

void Settings::text(const std::string& name, std::string& value, const std::string& form, const std::string& help,
                    const OptionTraits& traits) {
  Option option = made(Option::Type::kText, name, help, traits);
  option.form = form, option.default_value = value;
  if (const std::optional<std::string> given = declare(std::move(option))) set_value(value = *given);
}

void Settings::texts(const std::string& name, std::vector<std::string>& values, const std::string& form,
                     const std::string& help, const OptionTraits& traits) {
  Option option = made(Option::Type::kText, name, help, traits);
  option.form = form, option.repeats = true;
  if (const std::optional<std::string> given = declare(std::move(option))) values = lines_of(options_.back(), *given);
}

void Settings::only_if(bool applies, std::span<const char* const> names, const std::string& why) {
  if (applies) return;
  std::vector<std::string> given;
  for (const char* name : names) {
    const auto option = std::find_if(options_.begin(), options_.end(), [&](const Option& o) { return o.name == name; });
    COVARY_CHECK(option != options_.end(), "only options that were declared can be without effect");
    option->has_effect = false;
    if (source_->is_of_caller(*option)) given.push_back(fmt::format("`{}`", name));
  }
  if (given.empty()) return;
  throw Error(ErrorCode::kUsage,
              fmt::format("{} {} no effect {}", fmt::join(given, ", "), given.size() == 1 ? "has" : "have", why));
}

std::string Settings::film_text() const {
  std::string text;
  for (const Option& option : options_) {
    if (option.film.empty() || !option.has_effect) continue;
    std::string part = option.film;
    if (part.find("{:") != std::string::npos)
      part = fmt::format(fmt::runtime(part), std::stod(option.default_value));
    else if (part.find("{}") != std::string::npos)
      part = fmt::format(fmt::runtime(part), option.default_value);
    else if (option.default_value != "on")
      continue;
    text += (text.empty() ? "" : " ") + part;
  }
  return text;
}

}  // namespace covary
