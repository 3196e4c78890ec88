// SPDX-License-Identifier: Apache-2.0
// What iicv() and cv_baseline() do, for whatever carries it out: their checks, and the settings of the estimator that
// they share (control_variates.h).
#pragma once

#include "estimators/control_variates.h"
#include "estimators/cv_baseline.h"
#include "estimators/iicv.h"

namespace covary {

/// Which error of h the penalty contains.
enum class ErrorOfH { kNone, kVariance, kPilot };

/// The steps of an estimator by control variates.
struct VariateSteps {
  ControlVariateSettings settings;
  ErrorOfH error_of_h = ErrorOfH::kNone;
  bool missing_light = false;        ///< whether to find the light that the CRN image lacks
  bool residual_correction = false;  ///< which needs the standard error
  ResidualCorrectionOptions residual_options;
  bool std_error = false;  ///< whether the result has one
};

/// These throw Error(kUsage), listing every problem with the inputs, or Error(kInternal) for options out of range.
VariateSteps steps_of(const GroupedImage& crn, const GroupedImage& independent, const IicvOptions& options);
VariateSteps steps_of(const GroupedImage& crn, const GroupedImage& independent, const CvBaselineOptions& options);

/// The options of make_iicv() and make_cv_baseline(), declared to `settings`. Throw Error(kUsage) likewise.
IicvOptions declare_iicv(Settings& settings);
CvBaselineOptions declare_cv_baseline(Settings& settings);

}  // namespace covary
