// SPDX-License-Identifier: Apache-2.0
// The options of estimators (combine/registry.h) on the command line: the same for `covary render` and
// `covary combine`.
#pragma once

#include <CLI/CLI.hpp>
#include <span>
#include <string>
#include <vector>

#include "combine/registry.h"
#include "denoising/mixed_denoising.h"

namespace covary {

/// Group in the help of the options of estimators.
inline constexpr const char* kEstimatorGroup = "Estimator";

/// An estimator and its options as given; what is not given is the estimator's own default.
struct EstimatorOptions {
  std::string name = kDefaultEstimator;
  OptionValues values;
  std::string denoise = "none", oidn;  ///< --denoise, --oidn
  const CLI::App* command = nullptr;   ///< knows which options were given
};

/// Adds the options of these estimators, but `--estimator` itself. Equal names are one option, whose help has all
/// defaults.
/// `left_out`: names of options that the command does not have.
void add_estimator_options(CLI::App& command, EstimatorOptions& options, const std::vector<std::string>& estimators,
                           std::span<const char* const> left_out = {});

void add_denoise_option(CLI::App& command, EstimatorOptions& options);
void add_oidn_option(CLI::App& command, EstimatorOptions& options);

/// make_estimator() of the registry, and what --denoise makes of it: throws Error(kUsage) for options of another
/// estimator, values out of range, and where there is nothing to denoise.
Estimator make_estimator(const EstimatorOptions& options);

}  // namespace covary
