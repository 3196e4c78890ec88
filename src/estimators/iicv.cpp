// SPDX-License-Identifier: Apache-2.0
#include "estimators/iicv.h"

#include <fmt/format.h>

#include "estimators/control_variates.h"
#include "estimators/pilot.h"

namespace covary {

IicvOptions IicvOptions::paper() {
  IicvOptions options;
  options.sample_share = 0;
  options.conservation = 0;
  options.feedback = false;
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
  const int64_t candidates = int64_t{window} * window - (include_target ? 0 : 1);
  if (k < 1 || k > candidates)
    problems.push_back(fmt::format("k is {}, expected 1 to {}, the number of {}pixels in a window of {} x {}", k,
                                   candidates, include_target ? "" : "neighbouring ", window, window));
  if (probe && penalty == Penalty::kCrossFit)
    problems.push_back("the penalty cross-fit has two sets of coefficients, so that no pixel can be explained by one");
  if (!(ridge > 0)) problems.push_back(fmt::format("ridge is {}, expected a positive number", ridge));
  if (!(sample_share >= 0 && sample_share <= 1))
    problems.push_back(fmt::format("sample_share is {}, expected a number from 0 to 1", sample_share));
  if (!(conservation >= 0))
    problems.push_back(fmt::format("conservation is {}, expected zero or a positive number", conservation));
  if (feedback_options.window < 5 || feedback_options.window > 125 || feedback_options.window % 2 == 0)
    problems.push_back(
        fmt::format("feedback window is {}, expected an odd number from 5 to 125", feedback_options.window));
  if (!(feedback_options.bandwidth > 0))
    problems.push_back(fmt::format("feedback bandwidth is {}, expected a positive number", feedback_options.bandwidth));
  return problems;
}

EstimatorResult iicv(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options) {
  std::vector<std::string> problems = options.validate();
  const bool needs_variance = options.penalty == Penalty::kSample || options.std_error || options.feedback ||
                              (options.sample_share > 0 && options.penalty != Penalty::kHomogeneous);
  const bool halves = options.penalty == Penalty::kCrossFit;
  check_inputs(crn, independent, 3, halves ? (needs_variance ? 4 : 2) : (needs_variance ? 2 : 1), problems);
  throw_if_any("iicv", problems);

  EstimatorResult result;
  const std::vector<unsigned char> valid = finite_pixels(crn, independent, result.nonfinite_pixels);
  const int border = std::max(options.window, options.pilot_window) / 2;
  const Moments g = moments(crn, valid, border, kFar), h = moments(independent, valid, border, 0.0f);

  ControlVariateSettings settings;
  settings.k = options.k;
  settings.window = options.window;
  settings.include_target = options.include_target;
  settings.shared = options.shared_coefficients;
  settings.symmetric = options.symmetric;
  settings.conservation = options.conservation;
  settings.sample_share = options.sample_share;
  settings.std_error = options.std_error || options.feedback;
  settings.probe = options.probe;
  ControlVariateInput input{crn, &g};

  if (halves) {
    // Halves: even and odd groups. Each half's pilot judges the other half's values, so that the penalty is independent
    // of the value it belongs to.
    const Moments half[2] = {moments(independent, valid, border, 0.0f, 0, 2),
                             moments(independent, valid, border, 0.0f, 1, 2)};
    EstimatorResult part[2];
    for (int i : {0, 1}) {
      const Planes error = pilot_error(g, half[1 - i], options.pilot_window, false, border);
      input.h = &half[i].mean;
      input.error_of_h = &error;
      input.variance_of_h = &half[i].variance_of_mean;
      apply_control_variates(input, settings, valid, part[i]);
    }
    result.estimate = std::move(part[0].estimate);
    result.std_error = std::move(part[0].std_error);
    // The two estimates share the CRN image: their errors may be fully correlated, so that standard errors are
    // averaged.
    for (size_t i = 0; i < result.estimate.data.size(); ++i)
      result.estimate.data[i] = 0.5f * (result.estimate.data[i] + part[1].estimate.data[i]);
    for (size_t i = 0; i < result.std_error.data.size(); ++i)
      result.std_error.data[i] = 0.5f * (result.std_error.data[i] + part[1].std_error.data[i]);
  } else {
    Planes error;
    input.h = &h.mean;
    input.variance_of_h = &h.variance_of_mean;
    switch (options.penalty) {
      case Penalty::kSample:
        input.error_of_h = &h.variance_of_mean;
        break;
      case Penalty::kHomogeneous:
        settings.ridge = options.ridge;
        break;
      default:
        error = pilot_error(g, h, options.pilot_window, options.penalty == Penalty::kSmoothed, border);
        input.error_of_h = &error;
    }
    apply_control_variates(input, settings, valid, result);
  }
  if (options.feedback) {
    add_feedback(h, options.feedback_options, valid, result.std_error, result.estimate);
    if (!options.std_error) result.std_error = Image();
  }
  fill_invalid(crn, independent, valid, result.estimate);
  return result;
}

int iicv_reach(const IicvOptions& options) {
  const int pilot = options.pilot_window / 2 * (options.penalty == Penalty::kSmoothed ? 2 : 1);
  const int feedback = options.feedback ? feedback_reach(options.feedback_options) : 0;
  return options.window / 2 + pilot + feedback;
}

double iicv_bytes_per_pixel(const IicvOptions& options) {
  const bool halves = options.penalty == Penalty::kCrossFit;
  // Planes of floats: moments of both images, the result and its error, the pilot's error, residuals for the feedback.
  int planes = 2 * 6 + 6 + 3;
  if (options.penalty == Penalty::kSmoothed) planes += 3;
  if (halves) planes += 2 * 6 + 6;
  if (options.feedback) planes += 8 + 4;
  return planes * sizeof(float) + 1;
}

}  // namespace covary
