// SPDX-License-Identifier: Apache-2.0
// The filters of dependent tests on a device: dependent_tests/region_filter.h and dependent_tests/bound_filter.h.
// Values agree with the processor's to rounding; where growth of a region or a pixel's partners are a matter of
// rounding, that pixel may differ. Bit-identical on one device. Functions throw device::Failure.
#pragma once

#include "dependent_tests/bound_filter.h"
#include "dependent_tests/dependent_tests.h"
#include "dependent_tests/region_filter.h"
#include "device/device.h"

namespace covary::gpu {

FilteredImage region_filter(device::Device& device, const FilterInput& input, const RegionOptions& options,
                            bool planted_bug = false);
FilteredImage bound_filter(device::Device& device, const FilterInput& input, int window,
                           const Planes* difference_scale = nullptr, bool planted_bug = false);

/// dependent_tests() with its filters on a device.
EstimatorResult dependent_tests(device::Device& device, const GroupedImage& crn, const GroupedImage& independent,
                                const DependentTestsOptions& options);

}  // namespace covary::gpu
