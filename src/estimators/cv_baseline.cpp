// SPDX-License-Identifier: Apache-2.0
#include "estimators/cv_baseline.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "estimators/control_variates.h"
#include "estimators/estimator.h"
#include "estimators/missing_light.h"

namespace covary {

std::vector<std::string> CvBaselineOptions::validate() const {
  std::vector<std::string> problems;
  if (window < 3 || window > 63 || window % 2 == 0)
    problems.push_back(fmt::format("window is {}, expected an odd number from 3 to 63", window));
  check_k(k, window, include_target, problems);
  if (!(ridge >= 0)) problems.push_back(fmt::format("ridge is {}, expected zero or a positive number", ridge));
  return problems;
}

EstimatorResult cv_baseline(const GroupedImage& crn, const GroupedImage& independent,
                            const CvBaselineOptions& options) {
  std::vector<std::string> problems = options.validate();
  check_inputs(crn, independent, 3, options.std_error ? 2 : 1, problems);
  throw_if_any("cv_baseline", problems);

  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  const int border = std::max(options.window, kMissingWindow) / 2;
  const Moments g = moments(crn, valid, border, kFar), h = moments(independent, valid, border, 0.0f);
  ControlVariateSettings settings = common_settings(options);
  // [YM2025] Eq. (6) is Eq. (10) with V_h = 0. The ridge needs no scaling by 1 / (T - 1): it is relative to the mean
  // diagonal, of X^T X here and of X^T X / (T - 1) there.
  settings.ridge = options.ridge;
  ControlVariateInput input{crn, &g, &h.mean, nullptr, &h.variance_of_mean};
  std::optional<Planes> missing;
  if (options.std_error) input.missing = &missing.emplace(missing_light(g, h, valid, border));
  apply_control_variates(input, settings, valid, result);
  fill_invalid(crn, independent, valid, result.estimate);
  return result;
}

Estimator make_cv_baseline(Settings& parameters) {
  Settings& p = parameters;
  CvBaselineOptions o;
  p.whole("k", o.k, kVariatesRange, kVariatesHelp);
  p.whole("window", o.window, kWindowRange, kWindowHelp);
  p.real("ridge", o.ridge, {.low = 0}, "Ridge relative to the mean diagonal");
  if (p.flag("exclude-target", kExcludeTargetHelp)) o.include_target = false;
  p.choice<bool>("coefficients", o.shared_coefficients, kCoefficients, kCoefficientsHelp);
  throw_if_any("cv-baseline", o.validate());

  Estimator estimator;
  estimator.summary = "control variates that ignore the errors of the independent image";
  estimator.predicts_error = true;
  estimator.reliable_samples = kReliableSamples;
  estimator.fewest_groups = 3;
  estimator.reach = o.window / 2 + kMissingWindow / 2;
  estimator.memory.always = kCvBaselineBytesPerPixel;
  estimator.apply = [o](const GroupedImage& crn, const GroupedImage& independent, const PairSettings& settings) {
    CvBaselineOptions options = o;
    options.std_error = settings.std_error;
    return cv_baseline(crn, independent, options);
  };
  estimator.explain = explain_by_probe(cv_baseline, o);
  return estimator;
}

}  // namespace covary
