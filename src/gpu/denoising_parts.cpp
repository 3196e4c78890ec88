// SPDX-License-Identifier: Apache-2.0
#include "gpu/denoising_parts.h"

#include <span>
#include <utility>
#include <vector>

#include "core/error.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

constexpr const char* kFile = "group_moments.cl";

device::Kernel kernel(Device& device, const char* name, bool planted_bug = false) {
  return device.kernel(kFile, name, with_bug({}, planted_bug));
}

/// The largest value in the window of limited_groups.h.
Buffer<float> largest_around(Device& device, const Groups& groups, const Buffer<float>& values) {
  const device::Kernel largest = kernel(device, "largest_along");
  auto along_rows = device.make<float>(values.size()), result = device.make<float>(values.size());
  const device::Range image = image_of(groups.width, groups.height);
  device.launch(largest, image, kOfImage, values, groups.width, groups.height, 0, along_rows);
  device.launch(largest, image, kOfImage, along_rows, groups.width, groups.height, 1, result);
  return result;
}

PartBuffers part_of(Device& device, const Groups& groups, const GroupSet& set) {
  PartBuffers part;
  const int size = set.size(groups.groups);
  part.independent = moments(device, groups, set, nullptr);
  part.std_error = std_error_of(device, groups, part.independent.variance_of_mean, size - 1, 1);
  if (size < 2) return part;
  const Limits limits = limits_of(device, groups, set);
  MeanBuffers limited = moments(device, groups, set, &limits);
  part.limited_error = std_error_of(device, groups, limited.variance_of_mean, size - 1, 1);
  part.limited = std::move(limited.mean);
  return part;
}

}  // namespace

Buffer<float> samples_on(Device& device, const GroupedImage& image) {
  const size_t values = static_cast<size_t>(image.width) * image.height * image.groups * 3;
  const ValuesOnDevice* const there = image.on_device;
  if (there && there->of == image.data && there->device == device.info().id()) {
    auto borrowed = device.borrow<float>(there->handle, values);
    if (there->strides.empty()) return borrowed;
    const std::vector<int64_t>& apart = there->strides;
    const int n_pixels = image.width * image.height;
    auto ordered = device.make<float>(values);
    device.launch(kernel(device, "in_order"), list_of(static_cast<size_t>(n_pixels)), kOfList, borrowed, apart[0],
                  apart[1], apart[2], apart[3], image.groups, image.width, n_pixels, ordered);
    return ordered;
  }
  COVARY_CHECK(image.data, "an image without values here has them on the device that it is made on");
  return device.upload(std::span(image.data, values));
}

Groups upload(Device& device, const GroupedImage& image) {
  Groups result{image.width, image.height, image.groups, samples_on(device, image), {}, image.counts != nullptr, {}};
  const auto pixels = static_cast<size_t>(result.pixels());
  constexpr uint32_t kNone = 0;
  result.counts = device.upload(image.counts ? std::span(image.counts, pixels) : std::span(&kNone, 1));
  result.valid = device.make<unsigned char>(pixels);
  device.launch(kernel(device, "usable_pixels"), list_of(pixels), kOfList, result.data, image.groups, result.pixels(),
                result.valid);
  return result;
}

Buffer<float> upload(Device& device, const Planes& planes) {
  std::vector<float> values;
  values.reserve(static_cast<size_t>(planes.width()) * planes.height() * planes.count());
  for (int y = 0; y < planes.height(); ++y)
    for (int x = 0; x < planes.width(); ++x)
      for (int c = 0; c < planes.count(); ++c) values.push_back(planes.row(c, y)[x]);
  return device.upload(std::span(std::as_const(values)));
}

PartBuffers upload(Device& device, const DenoisingPart& part) {
  PartBuffers result;
  result.independent = {upload(device, part.independent.mean), upload(device, part.independent.variance_of_mean)};
  result.estimate = device.upload(std::span(part.image.estimate.data));
  result.std_error = device.upload(std::span(part.image.std_error.data));
  if (part.independent.relative_count) result.relative_count = upload(device, *part.independent.relative_count);
  return result;
}

Limits limits_of(Device& device, const Groups& groups, const GroupSet& set) {
  const auto pixels = static_cast<size_t>(groups.pixels());
  const auto odd = device.make<float>(pixels), even = device.make<float>(pixels);
  device.launch(kernel(device, "brightest_groups"), list_of(pixels), kOfList, groups.data, groups.valid, groups.groups,
                set.first, set.step, groups.pixels(), odd, even);
  return {largest_around(device, groups, odd), largest_around(device, groups, even)};
}

MeanBuffers moments(Device& device, const Groups& groups, const GroupSet& set, const Limits* limits, bool planted_bug) {
  const auto pixels = static_cast<size_t>(groups.pixels());
  MeanBuffers result{device.make<float>(3 * pixels), device.make<float>(3 * pixels)};
  const Limits none = limits ? Limits() : Limits{device.make<float>(1), device.make<float>(1)};
  const Limits& used = limits ? *limits : none;
  device.launch(kernel(device, "group_moments", planted_bug), list_of(pixels), kOfList, groups.data, groups.counts,
                int{groups.has_counts}, groups.valid, used.of_even, used.of_odd, int{limits != nullptr}, groups.groups,
                set.first, set.step, groups.pixels(), result.mean, result.variance_of_mean);
  return result;
}

Buffer<float> std_error_of(Device& device, const Groups& groups, const Buffer<float>& variance, int freedom,
                           float scale) {
  auto result = device.make<float>(variance.size());
  device.launch(kernel(device, "standard_error"), image_of(groups.width, groups.height), kOfImage, variance,
                groups.valid, groups.width, groups.height, static_cast<float>(freedom), scale, result);
  return result;
}

std::array<PartBuffers, 3> parts_of_mean(Device& device, const Groups& groups) {
  std::array<PartBuffers, 3> parts;
  parts[0] = part_of(device, groups, {});
  const Buffer<float>& variance = parts[0].independent.variance_of_mean;
  for (const int half : {0, 1}) {
    const GroupSet set{half, 2};
    PartBuffers& part = parts[half + 1] = part_of(device, groups, set);
    const int size = set.size(groups.groups);
    if (size > 1) continue;
    // A single group has no variance: that of all groups, of the surrounding pixels alone, gives it.
    const float more = static_cast<float>(groups.groups) / static_cast<float>(size);
    part.std_error = std_error_of(device, groups, variance, 0, more);
    const int values = 3 * groups.pixels();
    device.launch(kernel(device, "scaled"), list_of(static_cast<size_t>(values)), kOfList, variance, more, values,
                  part.independent.variance_of_mean);
  }
  device.launch(kernel(device, "fill_invalid"), image_of(groups.width, groups.height), kOfImage, groups.data,
                groups.valid, groups.groups, groups.width, groups.height, parts[0].independent.mean);
  return parts;
}

}  // namespace covary::gpu
