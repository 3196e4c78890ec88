// SPDX-License-Identifier: Apache-2.0
// Methods of a pair of images, on devices.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "estimators/method.h"
#include "gpu/target.h"
#include "settings/settings.h"

namespace covary::gpu {

/// Names of the methods of pairs that devices know.
std::vector<std::string> device_methods();

/// Lets a method of a pair, made of `options` and without what other modules add to it, run on the target. Others run
/// on the processor: throws Error(kUsage) for methods of pairs and of pixels that devices do not know if the target was
/// named.
void put_on(const std::shared_ptr<Target>& target, const OptionValues& options, Method& method);

}  // namespace covary::gpu
