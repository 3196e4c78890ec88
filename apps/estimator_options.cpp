// SPDX-License-Identifier: Apache-2.0
#include "estimator_options.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/error.h"
#include "estimators/cv_baseline.h"
#include "estimators/iduw.h"
#include "numbers.h"

namespace covary {
namespace {

template <typename T, typename U>
void set(T& target, const std::optional<U>& value) {
  if (value) target = *value;
}

template <typename Estimator, typename Options>
std::vector<ControlVariate> explain(Estimator estimator, const GroupedImage& crn, const GroupedImage& independent,
                                    Options options, int x, int y) {
  PixelProbe probe{x, y, {}};
  options.probe = &probe;
  estimator(crn, independent, options);
  return probe.control_variates;
}

constexpr std::array<std::pair<const char*, Penalty>, 5> kPenalties = {{{"pilot", Penalty::kPilot},
                                                                        {"sample", Penalty::kSample},
                                                                        {"smoothed", Penalty::kSmoothed},
                                                                        {"homogeneous", Penalty::kHomogeneous},
                                                                        {"cross-fit", Penalty::kCrossFit}}};

std::vector<std::string> penalty_names() {
  std::vector<std::string> names;
  for (const auto& [name, penalty] : kPenalties) names.emplace_back(name);
  return names;
}

/// `name` is one of penalty_names().
Penalty penalty_named(const std::string& name) {
  return std::find_if(kPenalties.begin(), kPenalties.end(), [&](const auto& known) { return name == known.first; })
      ->second;
}

PairEstimator make_iicv(const EstimatorOptions& o, bool std_error) {
  IicvOptions options = o.paper ? IicvOptions::paper() : IicvOptions();
  set(options.k, o.k);
  set(options.window, o.window);
  set(options.pilot_window, o.pilot_window);
  set(options.penalty, o.penalty);
  set(options.ridge, o.ridge);
  set(options.sample_share, o.sample_share);
  set(options.conservation, o.conservation);
  set(options.feedback, o.feedback);
  set(options.feedback_options.window, o.feedback_window);
  set(options.feedback_options.bandwidth, o.feedback_bandwidth);
  if (o.asymmetric) options.symmetric = false;
  if (o.exclude_target) options.include_target = false;
  if (!o.coefficients.empty()) options.shared_coefficients = o.coefficients == "shared";
  options.std_error = std_error;
  throw_if_any(o.name, options.validate());
  return {
      [options](const GroupedImage& crn, const GroupedImage& independent) { return iicv(crn, independent, options); },
      iicv_reach(options),
      [options](const GroupedImage& crn, const GroupedImage& independent, int x, int y) {
        return explain(iicv, crn, independent, options, x, y);
      },
      iicv_bytes_per_pixel(options)};
}

PairEstimator make_cv_baseline(const EstimatorOptions& o, bool std_error) {
  CvBaselineOptions options;
  set(options.k, o.k);
  set(options.window, o.window);
  set(options.ridge, o.ridge);
  if (o.exclude_target) options.include_target = false;
  if (!o.coefficients.empty()) options.shared_coefficients = o.coefficients == "shared";
  options.std_error = std_error;
  throw_if_any(o.name, options.validate());
  return {[options](const GroupedImage& crn, const GroupedImage& independent) {
            return cv_baseline(crn, independent, options);
          },
          options.window / 2,
          [options](const GroupedImage& crn, const GroupedImage& independent, int x, int y) {
            return explain(cv_baseline, crn, independent, options, x, y);
          },
          kCvBaselineBytesPerPixel};
}

PairEstimator make_iduw(const EstimatorOptions& o, int64_t crn_samples) {
  IduwOptions options;
  set(options.window, o.window);
  options.samples = static_cast<int>(crn_samples);
  throw_if_any(o.name, options.validate());
  return {
      [options](const GroupedImage& crn, const GroupedImage& independent) { return iduw(crn, independent, options); },
      -1,
      {},
      kIduwBytesPerPixel};
}

}  // namespace

const std::map<std::string, std::string>& estimators_of_option() {
  static const std::map<std::string, std::string> table = {
      {"--paper", "iicv"},
      {"--k", "iicv, cv-baseline"},
      {"--window", "iicv, cv-baseline, iduw"},
      {"--penalty", "iicv"},
      {"--pilot-window", "iicv"},
      {"--ridge", "iicv, cv-baseline"},
      {"--asymmetric", "iicv"},
      {"--exclude-target", "iicv, cv-baseline"},
      {"--coefficients", "iicv, cv-baseline"},
      {"--sample-share", "iicv"},
      {"--conservation", "iicv"},
      {"--feedback", "iicv"},
      {"--feedback-window", "iicv"},
      {"--feedback-bandwidth", "iicv"},
  };
  return table;
}

bool combines_pair(const std::string& estimator) { return estimator != "none" && estimator != "polynomials"; }

bool predicts_error(const std::string& estimator) { return estimator == "iicv" || estimator == "cv-baseline"; }

void add_estimator_options(CLI::App& command, EstimatorOptions& o) {
  o.command = &command;
  const auto add = [&](CLI::Option* option) { return option->group(kEstimatorGroup); };
  // Whole and other numbers; their ranges are the estimators' to know.
  const auto whole = [&](const char* name, std::optional<int>& value, const char* help) {
    using Limits = std::numeric_limits<int>;
    add(command.add_option(name, value, help))->transform(whole_number(Limits::min(), Limits::max()));
  };
  const auto real = [&](const char* name, std::optional<float>& value, const char* help) {
    add(command.add_option(name, value, help))->check(finite_number());
  };
  add(command.add_flag("--paper", o.paper, "iicv as published: no sample share, no conservation, no feedback"));
  whole("--k", o.k, "Number of control variates; default 25");
  whole("--window", o.window, "Side of the window they are chosen from; default 11 (iduw: 15)");
  add(command.add_option_function<std::string>(
          "--penalty,--variance", [&o](const std::string& name) { o.penalty = penalty_named(name); },
          "Error of the independent pixels: pilot, sample, smoothed, homogeneous or cross-fit; default pilot"))
      ->check(one_of(penalty_names()).description(""))
      ->type_name("NAME");
  whole("--pilot-window", o.pilot_window, "Side of the pilot's window; default 11");
  real("--ridge", o.ridge, "Factor of the homogeneous penalty (default 1), or ridge of cv-baseline (0)");
  add(command.add_flag("--asymmetric", o.asymmetric, "Penalty of the neighbour alone, not averaged with the target's"));
  add(command.add_flag("--exclude-target", o.exclude_target, "Leave the target out of its own control variates"));
  add(command.add_option("--coefficients", o.coefficients, "One coefficient for all channels, or one per channel"))
      ->check(one_of({"shared", "per-channel"}));
  real("--sample-share", o.sample_share, "Part of the penalty that is the sample variance; default 0.5");
  real("--conservation", o.conservation, "Weight of the condition sum beta g = f; default 30");
  add(command.add_option_function<std::string>(
          "--feedback", [&o](const std::string& text) { o.feedback = text == "on"; },
          "on or off: give back what the penalty takes away; default on"))
      ->check(one_of({"on", "off"}).description(""))
      ->type_name("on|off");
  whole("--feedback-window", o.feedback_window, "Side of the feedback's window; default 41");
  real("--feedback-bandwidth", o.feedback_bandwidth, "Bandwidth in standard errors; default 1.25");
}

void check_estimator_options(const EstimatorOptions& o) {
  for (const auto& [option, estimators] : estimators_of_option())
    if (o.command->count(option) && (", " + estimators + ",").find(", " + o.name + ",") == std::string::npos)
      throw Error(ErrorCode::kUsage,
                  fmt::format("{} is an option of --estimator {}, not of {}", option, estimators, o.name));
  if (combines_pair(o.name)) make_estimator(o, false, 1);
}

PairEstimator make_estimator(const EstimatorOptions& o, bool std_error, int64_t crn_samples) {
  if (o.name == "iicv") return make_iicv(o, std_error);
  if (o.name == "cv-baseline") return make_cv_baseline(o, std_error);
  if (o.name == "iduw") return make_iduw(o, crn_samples);
  throw Error(ErrorCode::kInternal, "estimator '" + o.name + "' does not combine a pair of images");
}

std::string EstimatorOptions::text() const {
  std::string result = name;
  for (const CLI::Option* option : command->get_options()) {
    if (option->get_group() != kEstimatorGroup || !option->count()) continue;
    result += " --" + option->get_lnames().front();
    if (option->get_expected_max() > 0)
      for (const std::string& value : option->results()) result += " " + value;
  }
  return result;
}

}  // namespace covary
