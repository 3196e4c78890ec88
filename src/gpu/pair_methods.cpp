// SPDX-License-Identifier: Apache-2.0
#include "gpu/pair_methods.h"

#include "estimators/iicv_steps.h"
#include "gpu/control_variates.h"

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
          own.std_error = settings.std_error;
          return work(device, crn, independent, own);
        },
        [&] { return image(crn, independent, settings); });
  };
}

}  // namespace

std::vector<std::string> device_methods() { return {kIicv, kCvBaseline}; }

void put_on(const std::shared_ptr<Target>& target, const OptionValues& options, Method& method) {
  Settings values(options);
  auto* pair = std::get_if<PassPair>(&method.passes);
  if (method.name == kIicv)
    pair->image = on_target(target, pair->image, declare_iicv(values), [](auto&&... a) { return iicv(a...); });
  else if (method.name == kCvBaseline)
    pair->image =
        on_target(target, pair->image, declare_cv_baseline(values), [](auto&&... a) { return cv_baseline(a...); });
}

}  // namespace covary::gpu
