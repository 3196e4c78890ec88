// SPDX-License-Identifier: Apache-2.0
// The image-space estimators on the command line: the same options for `covary render` and `covary combine`.
#pragma once

#include <CLI/CLI.hpp>
#include <functional>
#include <map>
#include <optional>
#include <string>

#include "estimators/iicv.h"

namespace covary {

/// Group in the help of the options of estimators.
inline constexpr const char* kEstimatorGroup = "Estimator";

/// Options as given; what is not given is the estimator's own default.
struct EstimatorOptions {
  std::string name = "iicv";
  std::string coefficients;
  bool paper = false, asymmetric = false, exclude_target = false;
  std::optional<int> k, window, pilot_window, feedback_window;
  std::optional<float> ridge, sample_share, conservation, feedback_bandwidth;
  std::optional<Penalty> penalty;
  std::optional<bool> feedback;
  /// Name and options as they were typed: "iicv --paper --k 50".
  std::string text() const;

  const CLI::App* command = nullptr;  ///< knows which options were given
};

/// An estimator with its options, as a function of a CRN and an independent image.
struct PairEstimator {
  std::function<EstimatorResult(const GroupedImage& crn, const GroupedImage& independent)> apply;
  int reach = 0;  ///< rows beyond its own that a band needs; -1: the whole image is needed
  /// The control variates of a pixel; empty function where the estimator has none.
  std::function<std::vector<ControlVariate>(const GroupedImage& crn, const GroupedImage& independent, int x, int y)>
      explain;
  double bytes_per_pixel = 0;  ///< memory that `apply` takes beside its input, about
};

/// The estimators that take an option, for each option that only the estimator reads: "--k" -> "iicv, cv-baseline".
const std::map<std::string, std::string>& estimators_of_option();

/// Whether the estimator makes its image of a CRN and an independent pass.
bool combines_pair(const std::string& estimator);

/// Whether the estimator can estimate the error of its result.
bool predicts_error(const std::string& estimator);

/// Adds the options of all estimators but `--estimator` itself.
void add_estimator_options(CLI::App& command, EstimatorOptions& options);

/// Throws Error(kUsage) for options of another estimator and for values out of range; for estimators of a single pass,
/// which take none of the options, too.
void check_estimator_options(const EstimatorOptions& options);

/// `std_error`: with the error estimate, where predicts_error(); `crn_samples`: samples per pixel of the CRN image.
/// Throws like check_estimator_options().
PairEstimator make_estimator(const EstimatorOptions& options, bool std_error, int64_t crn_samples);

}  // namespace covary
