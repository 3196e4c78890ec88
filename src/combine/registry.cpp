// SPDX-License-Identifier: Apache-2.0
#include "combine/registry.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "core/error.h"
#include "denoising/mixed_denoising.h"
#include "dependent_tests/dependent_tests.h"
#include "estimators/cv_baseline.h"
#include "estimators/iduw.h"
#include "estimators/iicv.h"
#include "estimators/polynomials.h"
#include "gpu/mixed_denoising.h"
#include "gpu/pair_methods.h"
#include "risk/held_out_error.h"
#include "settings/option_names.h"

namespace covary {

std::span<const MethodPlugin> estimator_plugins() {
  static constexpr MethodPlugin kPlugins[] = {
      {kMixture, make_mixture},
      {kIicv, make_iicv},
      {kCvBaseline, make_cv_baseline},
      {kIduw, make_iduw},
      {kDependentTests, make_dependent_tests},
      {kPolynomials, make_polynomials},
      {kMeanName, make_none},
  };
  return kPlugins;
}

namespace {

const MethodPlugin& plugin_named(const std::string& name) {
  for (const MethodPlugin& plugin : estimator_plugins())
    if (name == plugin.name) return plugin;
  const std::vector<std::string> names = estimator_names();
  throw Error(ErrorCode::kUsage, fmt::format("no estimator is named '{}'; expected {}{}", name, fmt::join(names, ", "),
                                             did_you_mean(name, names)));
}

}  // namespace

Method make_estimator(const std::string& name, const OptionValues& values, const MethodTarget& target) {
  const MethodPlugin& plugin = plugin_named(name);
  const std::vector<Option> own = options_of_estimator(name);
  for (const auto& [option, value] : values)
    if (!find_option(own, option)) refuse_option("estimator", name, own, option, estimators_with_option(option));
  Settings parameters(values);
  Method estimator = plugin.make(parameters);
  estimator.name = estimator.text = name;
  for (const Option& option : own) {
    const auto given = values.find(option.name);
    if (given == values.end()) continue;
    estimator.text += is_parameter(option) ? fmt::format(" --set {}={}", option.name, given->second)
                                           : fmt::format(" --{}", option.name);
  }
  if (target) gpu::put_on(target, values, estimator);
  return with_held_out_rows(estimator);
}

std::vector<std::string> estimator_names() {
  std::vector<std::string> names;
  for (const MethodPlugin& plugin : estimator_plugins()) names.emplace_back(plugin.name);
  return names;
}

std::vector<std::string> pair_estimator_names() {
  return estimators_where([](const Method& e) { return e.pair() != nullptr; });
}

std::vector<Option> options_of_estimator(const std::string& name) {
  Settings parameters;
  parameters.group("Estimator");
  plugin_named(name).make(parameters);
  return parameters.options();
}

std::vector<Option> options_of_estimators(const std::vector<std::string>& names) {
  std::vector<std::vector<Option>> lists;
  for (const std::string& name : names) lists.push_back(options_of_estimator(name));
  return merged_options(names, lists);
}

Method with_denoising(const Method& base, const DenoisingChoice& choice, const MethodTarget& target) {
  MixedDenoisingOptions options;
  options.mode = denoise_mode(choice.mode);
  if (options.mode != DenoiseMode::kNone && !can_be_denoised(base))
    throw Error(ErrorCode::kUsage, fmt::format("`denoise` needs an estimator that predicts its error ({}), not {}{}",
                                               fmt::join(estimators_where(can_be_denoised), ", "), base.name,
                                               base.adaptive ? " with adaptive numbers of samples" : ""));
  options.use_oidn = choice.oidn != "off";
  if (options.use_oidn) options.oidn.library = choice.oidn;
  options.history = choice.history;
  if (target) {
    const device::DeviceInfo& info = target->info();
    if (info.api == device::Api::kCuda) options.oidn.cuda_device = info.number;
    options.mix_pair = [target](const PairMixture& request, const std::function<MixedDenoising()>& here) {
      return target->run([&](device::Device& device) { return gpu::mix_pair(device, request); }, here);
    };
    options.mix_mean = [target](const MeanMixture& request, const std::function<MixedDenoising()>& here) {
      return target->run([&](device::Device& device) { return gpu::mix_mean(device, request); }, here);
    };
  }
  return with_denoising(base, options);
}

std::string default_denoising(const std::string& estimator) {
  return estimator == kDefaultEstimator ? DenoisingChoice::kAuto : DenoisingChoice::kNone;
}

Method make_default_estimator(bool is_pair, const OptionValues& values, const DenoisingChoice& choice,
                              const MethodTarget& target) {
  return with_denoising(make_estimator(is_pair ? kDefaultOfPairs : kDefaultEstimator, values, target), choice, target);
}

Method make_default_estimator() {
  return make_default_estimator(false, {}, {default_denoising(kDefaultEstimator), "", {}});
}

std::vector<std::string> estimators_with_option(const std::string& option) {
  std::vector<std::string> names;
  for (const MethodPlugin& plugin : estimator_plugins())
    if (find_option(options_of_estimator(plugin.name), option)) names.emplace_back(plugin.name);
  return names;
}

}  // namespace covary
