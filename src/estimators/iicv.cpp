// SPDX-License-Identifier: Apache-2.0
#include "estimators/iicv.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "estimators/control_variates.h"
#include "estimators/estimator.h"
#include "estimators/missing_light.h"
#include "estimators/pilot.h"

namespace covary {

IicvOptions IicvOptions::paper() {
  IicvOptions options;
  options.sample_fraction = 0;
  options.mean_constraint = 0;
  options.residual_correction = false;
  return options;
}

std::vector<std::string> IicvOptions::validate() const {
  std::vector<std::string> problems;
  const auto check_window = [&](const char* name, int value) {
    if (value < 3 || value > 63 || value % 2 == 0)
      problems.push_back(fmt::format("{} is {}, expected an odd number from 3 to 63", name, value));
  };
  check_window("window", window);
  check_window("pilot_window", pilot_window);
  check_k(k, window, include_target, problems);
  if (!(sample_fraction >= 0 && sample_fraction <= 1))
    problems.push_back(fmt::format("sample_fraction is {}, expected a number from 0 to 1", sample_fraction));
  if (!(mean_constraint >= 0))
    problems.push_back(fmt::format("mean_constraint is {}, expected zero or a positive number", mean_constraint));
  if (residual_options.window < 5 || residual_options.window > 125 || residual_options.window % 2 == 0)
    problems.push_back(fmt::format("residual correction: window is {}, expected an odd number from 5 to 125",
                                   residual_options.window));
  if (!(residual_options.bandwidth > 0))
    problems.push_back(
        fmt::format("residual correction: bandwidth is {}, expected a positive number", residual_options.bandwidth));
  return problems;
}

namespace {

ControlVariateSettings settings_of(const IicvOptions& options) {
  ControlVariateSettings settings = common_settings(options);
  settings.symmetric = options.symmetric;
  settings.mean_constraint = options.mean_constraint;
  settings.sample_fraction = options.sample_fraction;
  settings.std_error = options.std_error || options.residual_correction;
  return settings;
}

}  // namespace

EstimatorResult iicv(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options) {
  std::vector<std::string> problems = options.validate();
  const bool needs_variance = options.penalty == Penalty::kSample || options.std_error || options.residual_correction ||
                              options.sample_fraction > 0;
  check_inputs(crn, independent, 3, needs_variance ? 2 : 1, problems);
  throw_if_any(kIicv, problems);

  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  const int border = std::max({options.window, options.pilot_window, kMissingWindow}) / 2;
  const Moments g = moments(crn, valid, border, kFar), h = moments(independent, valid, border, 0.0f);
  const ControlVariateSettings settings = settings_of(options);
  ControlVariateInput input{crn, &g, &h.mean, &h.variance_of_mean, &h.variance_of_mean};
  std::optional<Planes> error, missing;
  if (options.penalty == Penalty::kPilot)
    input.error_of_h = &error.emplace(pilot_error(g, h, options.pilot_window, border));
  if (settings.std_error || settings.mean_constraint > 0)
    input.missing = &missing.emplace(missing_light(g, h, valid, border));
  apply_control_variates(input, settings, valid, result);
  if (options.residual_correction) {
    add_residual_correction(h, options.residual_options, valid, result.std_error, result.estimate);
    if (!options.std_error) result.std_error = Image();
  }
  fill_invalid(crn, independent, valid, result.estimate);
  return result;
}

int iicv_reach(const IicvOptions& options) {
  const int correction = options.residual_correction ? residual_correction_reach(options.residual_options) : 0;
  return options.window / 2 + std::max(options.pilot_window, kMissingWindow) / 2 + correction;
}

double iicv_bytes_per_pixel(const IicvOptions& options) {
  // Planes of floats: moments of both images, the result and its error, the pilot's error, light missing from the CRN
  // image and the buffers to find it; then the buffers of the residual correction.
  int planes = 2 * 6 + 6 + 3 + 3 + 6;
  if (options.residual_correction) planes += 8 + 4;
  return planes * sizeof(float) + 1;
}

namespace {

/// Rejects options that others make ineffective.
void check_effects(Settings& p, const IicvOptions& o) {
  const bool sample = o.penalty == Penalty::kSample;
  p.only_if(!sample, {"pilot-window"}, "with `penalty` sample, which has no pilot");
  p.only_if(!sample || o.symmetric, {"sample-fraction"},
            "with `penalty` sample and `asymmetric`: the penalty is the neighbour's sample variance already");
  p.only_if(o.sample_fraction < 1, {"asymmetric"},
            "with `sample-fraction` 1: the penalty is the neighbour's sample variance already");
}

}  // namespace

Estimator make_iicv(Settings& parameters) {
  static constexpr std::pair<const char*, Penalty> kPenalties[] = {{"pilot", Penalty::kPilot},
                                                                   {"sample", Penalty::kSample}};
  static constexpr std::pair<const char*, bool> kOnOff[] = {{"on", true}, {"off", false}};
  Settings& p = parameters;
  IicvOptions o = p.flag("paper", "iicv as published: no sample fraction, mean constraint or residual correction")
                      ? IicvOptions::paper()
                      : IicvOptions();
  p.whole("k", o.k, kVariatesRange, kVariatesHelp);
  p.whole("window", o.window, kWindowRange, kWindowHelp);
  p.choice<Penalty>("penalty", o.penalty, kPenalties, "Error of independent pixels", {.aliases = {"variance"}});
  p.whole("pilot-window", o.pilot_window, kWindowRange, "Side of the pilot's window");
  if (p.flag("asymmetric", "Use the neighbour's penalty alone, not averaged with the target's")) o.symmetric = false;
  if (p.flag("exclude-target", kExcludeTargetHelp)) o.include_target = false;
  p.choice<bool>("coefficients", o.shared_coefficients, kCoefficients, kCoefficientsHelp);
  p.real("sample-fraction", o.sample_fraction, {.low = 0, .high = 1}, "Fraction of the sample variance in the penalty",
         {.aliases = {"sample-share"}});
  p.real("mean-constraint", o.mean_constraint, {.low = 0}, "Weight of the constraint sum beta g = f",
         {.aliases = {"conservation"}});
  p.choice<bool>("residual-correction", o.residual_correction, kOnOff,
                 "Add back the smoothed residual, which the penalty suppresses", {.aliases = {"feedback"}});
  check_effects(p, o);
  std::vector<std::string> problems = o.validate();
  AdaptiveSampling standard;
  standard.least_min_spp = 1;  // the plan rounds up to one per group
  standard.most_first_spp = std::numeric_limits<int>::max();
  standard.reads_groups = true;
  Estimator estimator;
  estimator.adaptive =
      ask_for_adaptive(p, standard, "The CRN pass decides how many independent samples each pixel gets", problems);
  throw_if_any(kIicv, problems);

  estimator.summary = "imperfect image-space control variates";
  estimator.predicts_error = true;
  // Without it, the bias of a half exceeds that of the whole by too much (docs/methods/error-estimates.md).
  estimator.holds_out = o.residual_correction;
  estimator.reliable_samples = kReliableSamples;
  estimator.fewest_groups = 3;
  estimator.reach = iicv_reach(o);
  estimator.memory.always = iicv_bytes_per_pixel(o);
  estimator.apply = [o](const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings) {
    IicvOptions options = o;
    options.std_error = settings.std_error;
    return iicv(crn, independent, options);
  };
  estimator.explain = explain_by_probe(iicv, o);
  return estimator;
}

}  // namespace covary
