// SPDX-License-Identifier: Apache-2.0
// Estimators by control variates on a device: iicv() and cv_baseline(), with all their options, but for probes.
//
// Values agree with the processor's to rounding: 99.9 % of them within 1e-4 of value + 0.01. The same bits on one
// device: sums have a fixed order. A device that is too small for the image works on bands of it, which have the same
// bits as the whole. Functions throw device::Failure, and like the processor's.
#pragma once

#include "device/device.h"
#include "estimators/cv_baseline.h"
#include "estimators/iicv.h"
#include "gpu/trial.h"

namespace covary::gpu {

EstimatorResult iicv(device::Device& device, const GroupedImage& crn, const GroupedImage& independent,
                     const IicvOptions& options, const Trial& trial = {});
EstimatorResult cv_baseline(device::Device& device, const GroupedImage& crn, const GroupedImage& independent,
                            const CvBaselineOptions& options, const Trial& trial = {});

}  // namespace covary::gpu
