// SPDX-License-Identifier: Apache-2.0
#include "estimators/estimator_parameters.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

#include "core/error.h"

namespace covary {
namespace {

template <typename T>
T parse(const std::string& name, const std::string& text, const char* expected) {
  T value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(static_cast<double>(value)))
    throw Error(ErrorCode::kUsage, fmt::format("--{} '{}': expected {}", name, text, expected));
  return value;
}

}  // namespace

bool OptionRange::contains(double value) const {
  return (above_low ? value > low : value >= low) && value <= high && (!odd || std::abs(std::remainder(value, 2)) == 1);
}

std::string OptionRange::text() const {
  std::string bounds;
  if (std::isfinite(low) && std::isfinite(high))
    bounds = fmt::format("{}{:g} to {:g}", above_low ? "above " : "", low, high);
  else if (std::isfinite(low))
    bounds = fmt::format("{} {:g}", above_low ? "above" : "at least", low);
  return odd ? "odd, " + bounds : bounds;
}

void EstimatorParameters::only_if(bool applies, std::span<const char* const> names, const std::string& why) const {
  if (applies) return;
  std::vector<std::string> given;
  for (const char* name : names)
    if (values_.count(name) > 0) given.push_back(std::string("--") + name);
  if (given.empty()) return;
  throw Error(ErrorCode::kUsage,
              fmt::format("{} {} no effect {}", fmt::join(given, ", "), given.size() == 1 ? "has" : "have", why));
}

const std::string* EstimatorParameters::find(const EstimatorOption& option) const {
  const auto found = values_.find(option.name);
  return found == values_.end() ? nullptr : &found->second;
}

bool EstimatorParameters::flag(const std::string& name, const std::string& help) {
  options_.push_back({name, {}, EstimatorOption::Type::kFlag, "", {}, {}, help});
  return find(options_.back()) != nullptr;
}

void EstimatorParameters::whole(const std::string& name, int& value, const OptionRange& range,
                                const std::string& help) {
  options_.push_back({name, {}, EstimatorOption::Type::kWhole, fmt::to_string(value), range, {}, help});
  if (const std::string* text = find(options_.back())) value = parse<int>(name, *text, "a whole number");
}

void EstimatorParameters::real(const std::string& name, float& value, const OptionRange& range,
                               const std::string& help) {
  options_.push_back({name, {}, EstimatorOption::Type::kReal, fmt::format("{:g}", value), range, {}, help});
  if (const std::string* text = find(options_.back())) value = parse<float>(name, *text, "a number");
}

void EstimatorParameters::whole(const std::string& name, std::optional<int>& value, const OptionRange& range,
                                const std::string& help, const std::vector<std::string>& aliases) {
  options_.push_back({name, aliases, EstimatorOption::Type::kWhole, "", range, {}, help});
  if (const std::string* text = find(options_.back())) value = parse<int>(name, *text, "a whole number");
}

void EstimatorParameters::real(const std::string& name, std::optional<float>& value, const OptionRange& range,
                               const std::string& help) {
  options_.push_back({name, {}, EstimatorOption::Type::kReal, "", range, {}, help});
  if (const std::string* text = find(options_.back())) value = parse<float>(name, *text, "a number");
}

size_t EstimatorParameters::choose(const std::string& name, const std::vector<std::string>& aliases,
                                   const std::vector<std::string>& names, size_t standard, const std::string& help) {
  options_.push_back({name, aliases, EstimatorOption::Type::kChoice, names[standard], {}, names, help});
  const std::string* text = find(options_.back());
  if (!text) return standard;
  const auto found = std::find(names.begin(), names.end(), *text);
  if (found == names.end())
    throw Error(ErrorCode::kUsage, fmt::format("--{} '{}'{}: expected {}", name, *text, did_you_mean(*text, names),
                                               fmt::join(names, ", ")));
  return static_cast<size_t>(found - names.begin());
}

}  // namespace covary
