// SPDX-License-Identifier: Apache-2.0
#include "estimators/iicv.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "estimators/common_options.h"
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
  if (probe && penalty == Penalty::kCrossFit)
    problems.push_back("the penalty cross-fit has two sets of coefficients, so that no pixel can be explained by one");
  if (!(ridge > 0)) problems.push_back(fmt::format("ridge is {}, expected a positive number", ridge));
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

/// What the control variates of all pixels read, but for the independent image, its errors and its penalty.
struct Prepared {
  const GroupedImage& crn;
  const GroupedImage& independent;
  const IicvOptions& options;
  std::vector<unsigned char> valid;
  int border = 0;
  Moments g, h;  ///< of the CRN image and of the independent one

  ControlVariateSettings settings() const {
    ControlVariateSettings settings = common_settings(options);
    settings.symmetric = options.symmetric;
    settings.mean_constraint = options.mean_constraint;
    settings.sample_fraction = options.sample_fraction;
    settings.std_error = options.std_error || options.residual_correction;
    return settings;
  }
  /// `judge`: the independent image by which light that the CRN image lacks is found.
  void apply(const Moments& h_used, const Moments& judge, const Planes* error, const ControlVariateSettings& settings,
             EstimatorResult& result) const {
    ControlVariateInput input{crn, &g};
    input.h = &h_used.mean;
    input.variance_of_h = &h_used.variance_of_mean;
    input.error_of_h = error;
    std::optional<Planes> missing;
    if (settings.std_error || settings.mean_constraint > 0) {
      missing.emplace(missing_light(g, judge, valid, border));
      input.missing = &*missing;
    }
    apply_control_variates(input, settings, valid, result);
  }
};

/// Halves: even and odd groups. Each half's pilot judges the other half's values, so that the penalty is independent of
/// the value it belongs to.
void apply_by_halves(const Prepared& p, EstimatorResult& result) {
  const Moments half[2] = {moments(p.independent, p.valid, p.border, 0.0f, 0, 2),
                           moments(p.independent, p.valid, p.border, 0.0f, 1, 2)};
  EstimatorResult part[2];
  for (int i : {0, 1}) {
    const Planes error = pilot_error(p.g, half[1 - i], p.options.pilot_window, false, p.border);
    p.apply(half[i], half[1 - i], &error, p.settings(), part[i]);
  }
  result.estimate = std::move(part[0].estimate);
  result.std_error = std::move(part[0].std_error);
  // The two estimates share the CRN image: their errors may be fully correlated, so that standard errors are averaged.
  for (size_t i = 0; i < result.estimate.data.size(); ++i)
    result.estimate.data[i] = 0.5f * (result.estimate.data[i] + part[1].estimate.data[i]);
  for (size_t i = 0; i < result.std_error.data.size(); ++i)
    result.std_error.data[i] = 0.5f * (result.std_error.data[i] + part[1].std_error.data[i]);
}

void apply_at_once(const Prepared& p, EstimatorResult& result) {
  ControlVariateSettings settings = p.settings();
  switch (p.options.penalty) {
    case Penalty::kSample:
      return p.apply(p.h, p.h, &p.h.variance_of_mean, settings, result);
    case Penalty::kHomogeneous:
      settings.ridge = p.options.ridge;
      return p.apply(p.h, p.h, nullptr, settings, result);
    default:
      const Planes error =
          pilot_error(p.g, p.h, p.options.pilot_window, p.options.penalty == Penalty::kSmoothed, p.border);
      p.apply(p.h, p.h, &error, settings, result);
  }
}

}  // namespace

EstimatorResult iicv(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options) {
  std::vector<std::string> problems = options.validate();
  const bool needs_variance = options.penalty == Penalty::kSample || options.std_error || options.residual_correction ||
                              (options.sample_fraction > 0 && options.penalty != Penalty::kHomogeneous);
  const bool halves = options.penalty == Penalty::kCrossFit;
  check_inputs(crn, independent, 3, halves ? (needs_variance ? 4 : 2) : (needs_variance ? 2 : 1), problems);
  throw_if_any("iicv", problems);

  EstimatorResult result;
  Prepared p{crn, independent, options, finite_pixels(crn, independent, result.nonfinite_pixels), 0, {}, {}};
  p.border = std::max({options.window, options.pilot_window, kMissingWindow}) / 2;
  p.g = moments(crn, p.valid, p.border, kFar);
  p.h = moments(independent, p.valid, p.border, 0.0f);
  if (halves)
    apply_by_halves(p, result);
  else
    apply_at_once(p, result);
  if (options.residual_correction) {
    add_residual_correction(p.h, options.residual_options, p.valid, result.std_error, result.estimate);
    if (!options.std_error) result.std_error = Image();
  }
  fill_invalid(crn, independent, p.valid, result.estimate);
  return result;
}

int iicv_reach(const IicvOptions& options) {
  const int pilot = options.pilot_window / 2 * (options.penalty == Penalty::kSmoothed ? 2 : 1);
  const int correction = options.residual_correction ? residual_correction_reach(options.residual_options) : 0;
  return options.window / 2 + std::max(pilot, kMissingWindow / 2) + correction;
}

double iicv_bytes_per_pixel(const IicvOptions& options) {
  const bool halves = options.penalty == Penalty::kCrossFit;
  // Planes of floats: moments of both images, the result and its error, the pilot's error, light that the CRN image
  // lacks and what finds it, residuals for their correction.
  int planes = 2 * 6 + 6 + 3 + 3 + 6;
  if (options.penalty == Penalty::kSmoothed) planes += 3;
  if (halves) planes += 2 * 6 + 6;
  if (options.residual_correction) planes += 8 + 4;
  return planes * sizeof(float) + 1;
}

namespace {

/// Options that others leave without an effect.
void check_effects(Settings& p, const IicvOptions& o) {
  const bool homogeneous = o.penalty == Penalty::kHomogeneous, sample = o.penalty == Penalty::kSample;
  p.only_if(!homogeneous && !sample, {"pilot-window"},
            "with this `penalty`: only pilot, smoothed and cross-fit have a pilot");
  p.only_if(homogeneous, {"ridge"}, "with this `penalty`: it is the factor of homogeneous");
  p.only_if(!homogeneous, {"sample-fraction", "asymmetric"},
            "with `penalty` homogeneous: all neighbours have the same penalty");
  p.only_if(!sample || o.symmetric, {"sample-fraction"},
            "with `penalty` sample and `asymmetric`: the penalty is the neighbour's sample variance already");
  p.only_if(o.sample_fraction < 1, {"asymmetric"},
            "with `sample-fraction` 1: the penalty is the neighbour's sample variance already");
}

}  // namespace

Estimator make_iicv(Settings& parameters) {
  static constexpr std::pair<const char*, Penalty> kPenalties[] = {{"pilot", Penalty::kPilot},
                                                                   {"sample", Penalty::kSample},
                                                                   {"smoothed", Penalty::kSmoothed},
                                                                   {"homogeneous", Penalty::kHomogeneous},
                                                                   {"cross-fit", Penalty::kCrossFit}};
  static constexpr std::pair<const char*, bool> kOnOff[] = {{"on", true}, {"off", false}};
  Settings& p = parameters;
  IicvOptions o = p.flag("paper", "iicv as published: no sample fraction, mean constraint or residual correction")
                      ? IicvOptions::paper()
                      : IicvOptions();
  p.whole("k", o.k, kVariatesRange, kVariatesHelp);
  p.whole("window", o.window, kWindowRange, kWindowHelp);
  p.choice<Penalty>("penalty", o.penalty, kPenalties, "Error of the independent pixels", {.aliases = {"variance"}});
  p.whole("pilot-window", o.pilot_window, kWindowRange, "Side of the pilot's window");
  p.real("ridge", o.ridge, {.low = 0, .above_low = true}, "Factor of the homogeneous penalty");
  if (p.flag("asymmetric", "Penalty of the neighbour alone, not averaged with the target's")) o.symmetric = false;
  if (p.flag("exclude-target", kExcludeTargetHelp)) o.include_target = false;
  p.choice<bool>("coefficients", o.shared_coefficients, kCoefficients, kCoefficientsHelp);
  p.real("sample-fraction", o.sample_fraction, {.low = 0, .high = 1}, "Part of the penalty that is the sample variance",
         {.aliases = {"sample-share"}});
  p.real("mean-constraint", o.mean_constraint, {.low = 0}, "Weight of the condition sum beta g = f",
         {.aliases = {"conservation"}});
  p.choice<bool>("residual-correction", o.residual_correction, kOnOff,
                 "Add back the smoothed residual, which the penalty suppresses", {.aliases = {"feedback"}});
  check_effects(p, o);
  std::vector<std::string> problems = o.validate();
  AdaptiveSampling standard;
  standard.least_min_spp = 1;  // the plan rounds up to one of each group
  standard.most_first_spp = std::numeric_limits<int>::max();
  standard.reads_groups = true;
  Estimator estimator;
  estimator.adaptive =
      ask_for_adaptive(p, standard, "Distribute the independent samples over the pixels by the CRN pass", problems);
  throw_if_any("iicv", problems);

  estimator.summary = "imperfect image-space control variates";
  estimator.predicts_error = true;
  // Without it the bias of a half is too much larger than that of the whole (docs/methods/error-estimates.md).
  estimator.holds_out = o.residual_correction;
  estimator.reliable_samples = kReliableSamples;
  estimator.fewest_groups = o.penalty == Penalty::kCrossFit ? 4 : 3;
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
