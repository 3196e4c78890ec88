// SPDX-License-Identifier: Apache-2.0
// The estimators by name. A new estimator: one line in registry.cpp, one in CMake.
#pragma once

#include <memory>
#include <span>
#include <string>
#include <vector>

#include "denoising/mixture_name.h"
#include "estimators/iicv.h"
#include "estimators/method.h"
#include "risk/plain_mean.h"
#include "settings/settings.h"

namespace covary {

struct DenoisingChoice;
namespace gpu {
class Target;
}
/// A device to run on (gpu/target.h); null: the processor.
using MethodTarget = std::shared_ptr<gpu::Target>;

struct MethodPlugin {
  const char* name;
  /// Throws Error(kUsage) listing everything wrong with the options.
  Method (*make)(Settings& parameters);
};

/// All estimators, the default first.
std::span<const MethodPlugin> estimator_plugins();

/// What every command, bridge and library call does unless told otherwise: denoised images are mixed in where held-out
/// samples prefer them. Of independent samples it mixes into their mean, of a pair with common random numbers into that
/// pair's image (make_default_estimator()).
inline constexpr const char* kDefaultEstimator = kMixture;
inline constexpr const char* kNoEstimator = kMeanName;  ///< the film is the image
inline constexpr const char* kDefaultOfPairs = kIicv;   ///< whose image the default denoises

/// Throws Error(kUsage) for an unknown name, listing the known ones; for an option that the estimator does not have,
/// listing those that have it; and for values out of range. Of the default it makes what is denoised;
/// make_default_estimator() makes all of it. Methods that devices do not know run on the processor.
Method make_estimator(const std::string& name, const OptionValues& values = {}, const MethodTarget& target = {});

/// Names of the estimators for which `accepts` is true, with their default options.
template <typename Predicate>
std::vector<std::string> estimators_where(const Predicate& accepts) {
  std::vector<std::string> names;
  for (const MethodPlugin& plugin : estimator_plugins())
    if (accepts(make_estimator(plugin.name))) names.emplace_back(plugin.name);
  return names;
}
std::vector<std::string> estimator_names();
/// Those of a CRN and an independent image.
std::vector<std::string> pair_estimator_names();

/// The options of an estimator with their defaults. Throws Error(kUsage) like make_estimator().
std::vector<Option> options_of_estimator(const std::string& name);
/// The options of several estimators; equal names are one option.
std::vector<Option> options_of_estimators(const std::vector<std::string>& names);
/// Names of the estimators that have the option, without dashes; empty if none has.
std::vector<std::string> estimators_with_option(const std::string& option);

/// The estimator with the denoising that the texts describe. Throws Error(kUsage) if it cannot be denoised.
Method with_denoising(const Method& base, const DenoisingChoice& choice, const MethodTarget& target = {});

/// The value of `denoise` for an estimator if it was not given: auto for the default, none for those that are named.
std::string default_denoising(const std::string& estimator);
/// What the default means for a pair of images (`is_pair`) or for independent samples alone, with its options and
/// denoising. Throws Error(kUsage) like make_estimator() and with_denoising().
Method make_default_estimator(bool is_pair, const OptionValues& values, const DenoisingChoice& choice,
                              const MethodTarget& target = {});
/// For independent samples, as every command does it.
Method make_default_estimator();

}  // namespace covary
