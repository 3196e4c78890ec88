// SPDX-License-Identifier: Apache-2.0
#include "gpu/bands.h"

#include <algorithm>
#include <numeric>

namespace covary::gpu {
namespace {

/// Fraction of the memory that is used; the rest is for drivers and other programs.
constexpr double kOfMemory = 0.8;

/// Elements of a buffer that kernels count with an int.
constexpr double kMaxIndexed = 2147483647;

/// The mean number of samples belongs to the whole image.
GroupedImage with_mean_count(GroupedImage image) {
  const size_t n = static_cast<size_t>(image.width) * image.height;
  if (image.counts && image.mean_count <= 0)
    image.mean_count = std::accumulate(image.counts, image.counts + n, 0.0) / static_cast<double>(n);
  return image;
}

void copy_rows(const Image& from, int skipped, int y, int n, int height, Image& to) {
  if (from.data.empty()) return;
  if (to.data.empty()) to = Image(from.width, height, from.channels);
  std::copy(from.pixel(0, skipped), from.pixel(0, skipped) + static_cast<size_t>(n) * from.width * from.channels,
            to.pixel(0, y));
}

}  // namespace

int rows_that_fit(const device::DeviceInfo& device, int width, int height, const BandNeeds& needs) {
  const double by_memory = kOfMemory * static_cast<double>(device.memory) / (needs.bytes_per_pixel * width);
  const double largest = std::min(static_cast<double>(device.largest_buffer), kMaxIndexed * sizeof(float));
  const double by_buffer = largest / (needs.largest_buffer_per_pixel * width);
  return static_cast<int>(std::min({by_memory, by_buffer, static_cast<double>(height)}));
}

EstimatorResult in_bands(const GroupedImage& crn, const GroupedImage& independent, const BandNeeds& needs,
                         int rows_at_once,
                         const std::function<EstimatorResult(const GroupedImage&, const GroupedImage&)>& band) {
  const int height = crn.height;
  const GroupedImage a = with_mean_count(crn), b = with_mean_count(independent);
  EstimatorResult whole;
  for (int y = 0; y < height;) {
    if (rows_at_once >= height && y == 0) {
      try {
        return band(a, b);
      } catch (const device::Failure& failure) {
        if (failure.kind() != device::FailureKind::kMemory) throw;
        rows_at_once = height / 2;
        continue;
      }
    }
    const int own = (rows_at_once - 2 * needs.halo) / needs.alignment * needs.alignment;
    if (own < needs.alignment)
      throw device::Failure(device::FailureKind::kMemory,
                            "the device's memory is too small even for parts of the image");
    const int last = std::min(height, y + own);
    const int from = std::max(0, (y - needs.halo) / needs.alignment * needs.alignment);
    const int to = std::min(height, last + needs.halo);
    try {
      const EstimatorResult part = band(rows_of(a, from, to - from), rows_of(b, from, to - from));
      copy_rows(part.estimate, y - from, y, last - y, height, whole.estimate);
      copy_rows(part.std_error, y - from, y, last - y, height, whole.std_error);
      whole.nonfinite_pixels += part.nonfinite_pixels;
      y = last;
    } catch (const device::Failure& failure) {
      if (failure.kind() != device::FailureKind::kMemory) throw;
      rows_at_once /= 2;
    }
  }
  return whole;
}

}  // namespace covary::gpu
