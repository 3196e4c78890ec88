// SPDX-License-Identifier: Apache-2.0
#include "gpu/pair_methods.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "estimators/pair_steps.h"
#include "gpu/control_variates.h"
#include "gpu/dependent_filters.h"
#include "gpu/iduw.h"

namespace covary::gpu {
namespace {

using device::Device;
using ImageOfPair = decltype(PassPair::image);

/// `image`, on the target if `options` allow it: work(device, crn, independent, options).
template <typename Options, typename Work>
ImageOfPair on_target(const std::shared_ptr<Target>& target, const ImageOfPair& image, const Options& options,
                      const Work& work) {
  return [=](const GroupedImage& crn, const GroupedImage& independent, const MethodSettings& settings) {
    return target->run(
        [&](Device& device) -> MethodImage {
          Options own = options;
          if constexpr (requires { own.std_error; }) own.std_error = settings.std_error;
          if constexpr (requires { own.samples; }) own.samples = static_cast<int>(settings.crn_samples);
          return work(device, crn, independent, own);
        },
        [&] { return image(crn, independent, settings); });
  };
}

}  // namespace

std::vector<std::string> device_methods() { return {kIicv, kCvBaseline, kIduw, kDependentTests}; }

void put_on(const std::shared_ptr<Target>& target, const OptionValues& options, Method& method) {
  Settings values(options);
  auto* pair = std::get_if<PassPair>(&method.passes);
  if (method.name == kIicv) {
    pair->image = on_target(target, pair->image, declare_iicv(values), [](auto&&... a) { return iicv(a...); });
    method.memory.of_halves = 0;  // the device does not tell the covariance, so that the error comes from halves
  } else if (method.name == kCvBaseline)
    pair->image =
        on_target(target, pair->image, declare_cv_baseline(values), [](auto&&... a) { return cv_baseline(a...); });
  else if (method.name == kDependentTests)
    pair->image = on_target(target, pair->image, declare_dependent_tests(values).filter,
                            [](auto&&... a) { return dependent_tests(a...); });
  else if (method.name == kIduw)
    pair->image = on_target(target, pair->image, declare_iduw(values), [](auto&&... a) { return iduw(a...); });
  else if (!method.one_pass() && !target->is_automatic())
    throw Error(ErrorCode::kUsage, fmt::format("`device` {}: devices know the estimators {}; {} runs on the processor",
                                               target->info().id(), fmt::join(device_methods(), ", "), method.name));
}

}  // namespace covary::gpu
