// SPDX-License-Identifier: Apache-2.0
// Images in bands of rows, for devices whose memory does not hold all that a method needs.
#pragma once

#include <functional>

#include "device/device_info.h"
#include "estimators/estimator_result.h"
#include "film/grouped_image.h"

namespace covary::gpu {

/// What a method needs of a device.
struct BandNeeds {
  double bytes_per_pixel = 0;
  double largest_buffer_per_pixel = 0;  ///< bytes
  int halo = 0;                         ///< rows on each side that influence a row
  int alignment = 1;                    ///< bands begin at multiples of this
};

/// Rows of a band, with its halo on both sides, that fit 80 % of the device's memory and its largest buffer; at most
/// `height`.
int rows_that_fit(const device::DeviceInfo& device, int width, int height, const BandNeeds& needs);

/// The image of all rows from band(crn, independent), with the images of rows that it is given. Starts with
/// `rows_at_once` rows, and halves that when the device has not enough memory; rethrows once a band is all halo.
EstimatorResult in_bands(const GroupedImage& crn, const GroupedImage& independent, const BandNeeds& needs,
                         int rows_at_once,
                         const std::function<EstimatorResult(const GroupedImage&, const GroupedImage&)>& band);

}  // namespace covary::gpu
