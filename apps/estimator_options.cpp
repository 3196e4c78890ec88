// SPDX-License-Identifier: Apache-2.0
#include "estimator_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "numbers.h"
#include "value_names.h"

namespace covary {
namespace {

/// An option of several estimators: that of the first, and help that says where others differ.
struct SharedOption {
  EstimatorOption option;
  std::string help;
};

std::vector<SharedOption> shared_options(const std::vector<std::string>& estimators) {
  std::vector<SharedOption> shared;
  for (const std::string& estimator : estimators)
    for (const EstimatorOption& option : options_of_estimator(estimator)) {
      const auto known = std::find_if(shared.begin(), shared.end(),
                                      [&](const SharedOption& s) { return s.option.name == option.name; });
      const std::string& standard = option.default_value;
      if (known == shared.end())
        shared.push_back({option, option.help + (standard.empty() ? "" : "; default " + standard)});
      else if (known->option.help != option.help)
        known->help +=
            fmt::format("; {}: {}{}", estimator, option.help, standard.empty() ? "" : ", default " + standard);
      else if (known->option.default_value != standard)
        known->help += fmt::format(" ({}: {})", estimator, standard);
    }
  return shared;
}

/// Numbers are read as text, as the estimator reads them; here it is seen that they are numbers, and in the range where
/// that is the same whatever the other options are.
void check_numbers(CLI::Option& option, const EstimatorOption& what) {
  const bool is_whole = what.type == EstimatorOption::Type::kWhole;
  option.type_name(is_whole ? "INT" : "FLOAT");
  using Limits = std::numeric_limits<int>;
  if (!is_whole)
    option.check(finite_number());
  else if (!what.range.odd && std::isfinite(what.range.high))
    option.transform(whole_number(static_cast<int>(what.range.low), static_cast<int>(what.range.high)));
  else
    option.transform(whole_number(Limits::min(), Limits::max()));
}

}  // namespace

void add_estimator_options(CLI::App& command, EstimatorOptions& o, const std::vector<std::string>& estimators,
                           std::span<const char* const> left_out) {
  o.command = &command;
  for (const SharedOption& shared : shared_options(estimators)) {
    const EstimatorOption& what = shared.option;
    if (std::find(left_out.begin(), left_out.end(), what.name) != left_out.end()) continue;
    std::string names = "--" + what.name;
    for (const std::string& alias : what.aliases) names += ",--" + alias;
    const auto set = [&o, name = what.name](const std::string& text) { o.values[name] = text; };
    CLI::Option* option = nullptr;
    if (what.type == EstimatorOption::Type::kFlag) {
      option = command.add_flag_callback(
          names, [set] { set(""); }, shared.help);
    } else {
      option = command.add_option_function<std::string>(names, set, shared.help);
      if (what.type == EstimatorOption::Type::kChoice)
        option->check(one_of(what.choices));
      else
        check_numbers(*option, what);
    }
    option->group(kEstimatorGroup);
  }
}

void add_denoise_option(CLI::App& command, EstimatorOptions& o) {
  command
      .add_option("--denoise", o.denoise,
                  "Mix the image with denoised ones where held-out samples find that better: for least bias, for least "
                  "error, or balanced")
      ->check(one_of(denoise_mode_names()))
      ->capture_default_str();
}

void add_oidn_option(CLI::App& command, EstimatorOptions& o) {
  command
      .add_option("--oidn", o.oidn,
                  "For --denoise: Open Image Denoise's library or a folder of it; default: where it is found; 'off': "
                  "without it")
      ->type_name("off|LIBRARY");
}

Estimator make_estimator(const EstimatorOptions& o) {
  return with_denoising(make_estimator(o.name, o.values), o.denoise, o.oidn);
}

}  // namespace covary
