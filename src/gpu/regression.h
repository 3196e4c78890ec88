// SPDX-License-Identifier: Apache-2.0
// filters/regression.h on a device: first-order regression on auxiliary features, of one image.
#pragma once

#include <vector>

#include "device/device.h"
#include "gpu/nl_means.h"

namespace covary::gpu {

/// Features of all pixels, three channels an image: those of order 1, and the position last.
struct FeatureBuffer {
  device::Buffer<float> values;
  int count = 0;  ///< a pixel
  bool has_position = false;
};
FeatureBuffer features_of(device::Device& device, const std::vector<const device::Buffer<float>*>& images,
                          const device::Buffer<float>* position);

struct RegressionBuffers {
  int width = 0, height = 0;
  const device::Buffer<float>* image = nullptr;
  const device::Buffer<float>* std_error = nullptr;
  const device::Buffer<unsigned char>* valid = nullptr;
  const FeatureBuffer* features = nullptr;
  Place other;          ///< another filter's image
  bool coarse = false;  ///< RegressionInput::coarse
  bool planted_bug = false;
  /// Of windows, kept between two kernels: at most 128 MiB, and a sixteenth of the device's memory.
  size_t weights_at_once = size_t{1} << 25;
  const device::Buffer<float>* source = nullptr;  ///< what is fitted; null: the image itself
};

/// The filtered image, at the beginning of `result`. The number of weights that are kept at once may change bits, as
/// the order of sums does.
void regressed(device::Device& device, const RegressionBuffers& input, const device::Buffer<float>& result);

}  // namespace covary::gpu
