// SPDX-License-Identifier: Apache-2.0
// Options of an estimator are declared settings (settings/settings.h): what it asks for when it is made is the list of
// its options, with the values of its options struct as defaults.
#pragma once

#include "settings/settings.h"

namespace covary {

using EstimatorParameters = Settings;
using EstimatorOption = Option;

}  // namespace covary
