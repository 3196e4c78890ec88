// SPDX-License-Identifier: Apache-2.0
// What denoising/denoising_parts.h makes of independent samples, on a device: usable pixels, and means with errors of
// all samples and of both halves, also without fireflies (denoising/limited_groups.h).
#pragma once

#include <array>
#include <cstdint>

#include "denoising/denoising_parts.h"
#include "device/device.h"
#include "film/grouped_image.h"

namespace covary::gpu {

using device::Buffer;
using device::Device;

/// A grouped image, and 1 for each pixel whose values are all usable.
struct Groups {
  int width = 0, height = 0, groups = 0;
  Buffer<float> data;
  Buffer<uint32_t> counts;  ///< one element if the image has none
  bool has_counts = false;
  Buffer<unsigned char> valid;

  int pixels() const { return width * height; }
};
Groups upload(Device& device, const GroupedImage& image);
/// The samples of an image on the device: where they are there already (GroupedImage::on_device), in place, or brought
/// into its order; otherwise sent there.
Buffer<float> samples_on(Device& device, const GroupedImage& image);

/// Groups first, first + step, …
struct GroupSet {
  int first = 0, step = 1;
  int size(int groups) const { return (groups - first + step - 1) / step; }
};

/// The largest brightness of groups of the other parity around each pixel, which limits groups 0, 2, … and 1, 3, … of
/// a set.
struct Limits {
  Buffer<float> of_even, of_odd;
};
Limits limits_of(Device& device, const Groups& groups, const GroupSet& set);

/// Images with three channels.
struct MeanBuffers {
  Buffer<float> mean, variance_of_mean;
};
/// Of a set of groups, scaled down to the limits, if given.
MeanBuffers moments(Device& device, const Groups& groups, const GroupSet& set, const Limits* limits,
                    bool planted_bug = false);

/// The standard error from a variance of `freedom` degrees of freedom, multiplied by `scale`.
Buffer<float> std_error_of(Device& device, const Groups& groups, const Buffer<float>& variance, int freedom,
                           float scale);

/// A set of samples.
struct PartBuffers {
  MeanBuffers independent;
  Buffer<float> std_error;
  /// Without fireflies; empty for a set of one group, which has no other to confirm them.
  Buffer<float> limited, limited_error;
  Buffer<float> estimate;        ///< the image, if that is not the mean
  Buffer<float> relative_count;  ///< of samples, for that image; empty if all pixels have the same number

  const Buffer<float>& image() const { return estimate ? estimate : independent.mean; }
  const Buffer<float>& noisy() const { return limited ? limited : image(); }
  const Buffer<float>& noisy_error() const { return limited ? limited_error : std_error; }
};

/// The planes without their border, interleaved.
Buffer<float> upload(Device& device, const Planes& planes);
/// The image of an estimator of two passes.
PartBuffers upload(Device& device, const DenoisingPart& part);

/// All samples and both halves, of two groups or more.
std::array<PartBuffers, 3> parts_of_mean(Device& device, const Groups& groups);

}  // namespace covary::gpu
