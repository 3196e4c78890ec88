// SPDX-License-Identifier: Apache-2.0
// iduw() on a device. Values agree with the processor's as those of gpu/control_variates.h; the same choice of gamma,
// unless two are equally good to six digits. The whole image must fit the device's memory.
#pragma once

#include "device/device.h"
#include "estimators/iduw.h"
#include "gpu/trial.h"

namespace covary::gpu {

EstimatorResult iduw(device::Device& device, const GroupedImage& crn, const GroupedImage& independent,
                     const IduwOptions& options, float* chosen_gamma = nullptr, const Trial& trial = {});

}  // namespace covary::gpu
