// SPDX-License-Identifier: Apache-2.0
// The method `none`: the plain mean of the samples, and its error.
#pragma once

#include "estimators/method.h"
#include "settings/settings.h"

namespace covary {

inline constexpr const char* kMeanName = "none";
/// The method with these options. Throws Error(kUsage) listing everything wrong with them.
Method make_none(Settings& options);

}  // namespace covary
