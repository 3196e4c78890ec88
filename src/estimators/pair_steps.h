// SPDX-License-Identifier: Apache-2.0
// What iicv(), cv_baseline() and iduw() do, for whatever carries it out: their checks, and the settings of the
// estimator that the first two share (control_variates.h).
#pragma once

#include "estimators/control_variates.h"
#include "estimators/cv_baseline.h"
#include "estimators/iduw.h"
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

/// Throws likewise.
void check_iduw(const GroupedImage& crn, const GroupedImage& independent, const IduwOptions& options);

/// The options of make_iicv(), make_cv_baseline() and make_iduw(), declared to `settings`. Throw Error(kUsage)
/// likewise.
IicvOptions declare_iicv(Settings& settings);
CvBaselineOptions declare_cv_baseline(Settings& settings);
IduwOptions declare_iduw(Settings& settings);

}  // namespace covary
