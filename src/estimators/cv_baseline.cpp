// SPDX-License-Identifier: Apache-2.0
#include "estimators/cv_baseline.h"

#include <algorithm>
#include <optional>

#include "core/error.h"
#include "estimators/control_variates.h"
#include "estimators/method.h"
#include "estimators/missing_light.h"
#include "estimators/pair_steps.h"

namespace covary {

VariateSteps steps_of(const GroupedImage& crn, const GroupedImage& independent, const CvBaselineOptions& options) {
  COVARY_CHECK(options.ridge >= 0, "options of cv-baseline are in the ranges that cv_baseline.h states");
  std::vector<std::string> problems;
  check_k(options.k, options.window, problems);
  check_inputs(crn, independent, 3, options.std_error ? 2 : 1, problems);
  throw_if_any("cv_baseline", problems);

  VariateSteps steps;
  steps.settings = common_settings(options);
  // [YM2025] Eq. (6) is Eq. (10) with V_h = 0. The ridge needs no scaling by 1 / (T - 1): it is relative to the mean
  // diagonal, of X^T X here and of X^T X / (T - 1) there.
  steps.settings.ridge = options.ridge;
  steps.missing_light = steps.std_error = options.std_error;
  return steps;
}

EstimatorResult cv_baseline(const GroupedImage& crn, const GroupedImage& independent,
                            const CvBaselineOptions& options) {
  const VariateSteps steps = steps_of(crn, independent, options);
  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  const int border = std::max(options.window, kMissingWindow) / 2;
  const Moments g = moments(crn, valid, border, kFar), h = moments(independent, valid, border, 0.0f);
  ControlVariateInput input{crn, &g, &h.mean, nullptr, &h.variance_of_mean};
  std::optional<Planes> missing;
  if (steps.missing_light) input.missing = &missing.emplace(missing_light(g, h, valid, border));
  apply_control_variates(input, steps.settings, valid, result);
  fill_invalid(crn, independent, valid, result.estimate);
  return result;
}

CvBaselineOptions declare_cv_baseline(Settings& p) {
  CvBaselineOptions o;
  p.whole("k", o.k, kVariatesRange, kVariatesHelp);
  p.whole("window", o.window, kWindowRange, kWindowHelp);
  p.real("ridge", o.ridge, {.low = 0}, "Ridge relative to the mean diagonal");
  std::vector<std::string> problems;
  check_k(o.k, o.window, problems);
  throw_if_any(kCvBaseline, problems);
  return o;
}

Method make_cv_baseline(Settings& parameters) {
  const CvBaselineOptions o = declare_cv_baseline(parameters);
  Method estimator;
  estimator.passes = pair_by(cv_baseline, o);
  estimator.summary = "control variates that ignore the errors of the independent image";
  estimator.predicts_error = true;
  estimator.reliable_samples = kReliableSamples;
  estimator.min_groups = 3;
  estimator.halo = o.window / 2 + kMissingWindow / 2;
  estimator.memory.always = kCvBaselineBytesPerPixel;
  return estimator;
}

}  // namespace covary
