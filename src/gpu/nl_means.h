// SPDX-License-Identifier: Apache-2.0
// filters/nl_means.h on a device: an image averaged with weights of its own at one or two bandwidths.
#pragma once

#include <span>
#include <vector>

#include "device/device.h"

namespace covary::gpu {

/// An image that lies in a buffer from element `first` on.
struct Place {
  const device::Buffer<float>* buffer = nullptr;
  size_t first = 0;
};

/// A feature, to be divided by `unit`.
struct FeatureImage {
  const device::Buffer<float>* image = nullptr;
  float unit = 1;
};

struct NlMeansInput {
  int width = 0, height = 0;
  const device::Buffer<float>* image = nullptr;
  const device::Buffer<float>* std_error = nullptr;
  const device::Buffer<unsigned char>* valid = nullptr;
  std::vector<FeatureImage> features;             ///< at most two
  std::vector<float> bandwidths;                  ///< one or two
  bool planted_bug = false;                       ///< for tests
  const device::Buffer<float>* source = nullptr;  ///< what is averaged; null: the image itself
};

/// Writes the filtered image of each bandwidth to its place.
void nl_means(device::Device& device, const NlMeansInput& input, std::span<const Place> results);

}  // namespace covary::gpu
