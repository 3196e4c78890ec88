// SPDX-License-Identifier: Apache-2.0
#include "estimators/iicv.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "core/error.h"
#include "core/parallel.h"
#include "estimators/control_variates.h"
#include "estimators/method.h"
#include "estimators/missing_light.h"
#include "estimators/own_noise.h"
#include "estimators/pair_steps.h"
#include "estimators/pilot.h"

namespace covary {

IicvOptions IicvOptions::paper() {
  IicvOptions options;
  options.sample_fraction = 0;
  options.mean_constraint = 0;
  options.residual_correction = false;
  return options;
}

namespace {

constexpr int kPilotWindow = 11;  // [YM2025] Eq. (11)

/// The ranges that make_iicv() declares.
bool in_range(const IicvOptions& o) {
  return o.sample_fraction >= 0 && o.sample_fraction <= 1 && o.mean_constraint >= 0;
}

/// The covariance of the residual correction, which adds h with the weight `own`.
void add_own_residual(const Moments& h, const Image& own, Image& covariance) {
  parallel_for(own.height, 8, [&](int y) {
    for (int x = 0; x < own.width; ++x)
      for (int c = 0; c < 3; ++c) covariance.pixel(x, y)[c] += *own.pixel(x, y) * h.variance_of_mean.row(c, y)[x];
  });
}

}  // namespace

VariateSteps steps_of(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options) {
  COVARY_CHECK(in_range(options), "options of iicv are in the ranges that iicv.h states");
  std::vector<std::string> problems;
  check_k(options.k, options.window, problems);
  const bool needs_variance = options.penalty == Penalty::kSample || options.std_error || options.residual_correction ||
                              options.covariance || options.sample_fraction > 0;
  check_inputs(crn, independent, 3, needs_variance ? 2 : 1, problems);
  throw_if_any(kIicv, problems);

  VariateSteps steps;
  steps.settings = common_settings(options);
  steps.settings.symmetric = options.penalty != Penalty::kAsymmetric;
  steps.settings.mean_constraint = options.mean_constraint;
  steps.settings.sample_fraction = options.sample_fraction;
  steps.settings.std_error = options.std_error || options.residual_correction;
  steps.error_of_h = options.penalty == Penalty::kSample ? ErrorOfH::kVariance : ErrorOfH::kPilot;
  steps.missing_light = steps.settings.std_error || options.mean_constraint > 0;
  steps.residual_correction = options.residual_correction;
  steps.residual_options = options.residual_options;
  steps.std_error = options.std_error;
  return steps;
}

EstimatorResult iicv(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options) {
  const VariateSteps steps = steps_of(crn, independent, options);
  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  const int border = std::max({options.window, kPilotWindow, kMissingWindow}) / 2;
  const Moments g = moments(crn, valid, border, kFar), h = moments(independent, valid, border, 0.0f);
  ControlVariateInput input{crn, &g, &h.mean, &h.variance_of_mean, &h.variance_of_mean};
  std::optional<Planes> error, missing;
  std::optional<Planes> slope;
  std::optional<OwnChanges> changes;
  if (steps.error_of_h == ErrorOfH::kPilot) {
    if (options.covariance) slope.emplace(crn.width, crn.height, 3, 0, 0.0f);
    input.error_of_h = &error.emplace(pilot_error(g, h, kPilotWindow, border, slope ? &*slope : nullptr));
  }
  if (options.covariance)
    input.changes = &changes.emplace(
        own_changes(independent, h, slope ? &*slope : nullptr, crn.groups, steps.settings.shared, valid));
  if (steps.missing_light) input.missing = &missing.emplace(missing_light(g, h, valid, border));
  apply_control_variates(input, steps.settings, valid, result);
  if (steps.residual_correction) {
    Image own_weight = options.covariance ? Image(crn.width, crn.height, 1) : Image();
    add_residual_correction(h, steps.residual_options, valid, result.std_error, result.estimate,
                            options.covariance ? &own_weight : nullptr);
    if (options.covariance) add_own_residual(h, own_weight, result.covariance);
    if (!steps.std_error) result.std_error = Image();
  }
  fill_invalid(crn, independent, valid, result.estimate);
  return result;
}

int iicv_halo(const IicvOptions& options) {
  const int correction = options.residual_correction ? residual_correction_halo(options.residual_options) : 0;
  return options.window / 2 + std::max(kPilotWindow, kMissingWindow) / 2 + correction;
}

double iicv_bytes_per_pixel(const IicvOptions& options) {
  // Planes of floats: moments of both images, the result and its error, the pilot's error, light missing from the CRN
  // image and the buffers to find it; then the buffers of the residual correction.
  int planes = 2 * 6 + 6 + 3 + 3 + 6;
  if (options.residual_correction) planes += 8 + 4;
  return planes * sizeof(float) + 1;
}

IicvOptions declare_iicv(Settings& p) {
  static constexpr std::pair<const char*, Penalty> kPenalties[] = {
      {"pilot", Penalty::kPilot}, {"sample", Penalty::kSample}, {"asymmetric", Penalty::kAsymmetric}};
  IicvOptions o = p.flag("paper", "iicv as published: no sample fraction, mean constraint or residual correction")
                      ? IicvOptions::paper()
                      : IicvOptions();
  p.whole("k", o.k, kVariatesRange, kVariatesHelp);
  p.whole("window", o.window, kWindowRange, kWindowHelp);
  p.choice<Penalty>("penalty", o.penalty, kPenalties,
                    "Error of independent pixels; asymmetric: pilot of neighbours alone");
  std::vector<std::string> problems;
  check_k(o.k, o.window, problems);
  throw_if_any(kIicv, problems);
  return o;
}

Method make_iicv(Settings& p) {
  const IicvOptions o = declare_iicv(p);
  AdaptiveSampling standard;
  standard.max_first_spp = std::numeric_limits<int>::max();
  standard.reads_groups = true;
  Method estimator;
  PassPair pair = pair_by(iicv, o);
  estimator.adaptive =
      ask_for_adaptive(p, standard, "The CRN pass decides how many independent samples each pixel gets");
  if (o.residual_correction && !estimator.adaptive)  // otherwise no risk is derived from it (risk/held_out_error.h)
    pair.image = [o](const GroupedImage& crn, const GroupedImage& independent, const MethodSettings& settings) {
      IicvOptions own = o;
      own.std_error = settings.std_error;
      own.covariance = settings.std_error && settings.held_out;
      return iicv(crn, independent, own);
    };
  estimator.passes = std::move(pair);

  estimator.summary = "imperfect image-space control variates";
  estimator.predicts_error = true;
  // Without it, the bias of a half exceeds that of the whole by too much (docs/methods/error-estimates.md).
  estimator.holds_out = o.residual_correction;
  estimator.reliable_samples = kReliableSamples;
  estimator.min_groups = 3;
  estimator.halo = iicv_halo(o);
  estimator.memory.always = iicv_bytes_per_pixel(o);
  if (o.residual_correction) {  // what the covariance takes: slope, changes, itself, own weights
    estimator.memory.of_halves = (3 + 6 + 3 + 1) * sizeof(float);
    estimator.memory.groups_for_halves = 2 * estimator.min_groups;
  }
  return estimator;
}

}  // namespace covary
