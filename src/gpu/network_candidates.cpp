// SPDX-License-Identifier: Apache-2.0
#include "gpu/network_candidates.h"

#include <fmt/format.h>

#include <vector>

#include "denoising/candidates.h"
#include "film/groups.h"
#include "filters/relative_counts.h"
#include "gpu/launch.h"
#include "gpu/residual_correction.h"

namespace covary::gpu {
namespace {

device::Kernel kernel(Device& device, const char* name, int side, bool planted_bug = false) {
  return device.kernel("residual_correction.cl", name, with_bug({fmt::format("SIDE={}", side)}, planted_bug));
}

}  // namespace

Buffer<float> relative_counts_of(Device& device, const GroupedImage& image, const GroupSet& set) {
  if (!image.counts) return {};
  GroupedImage of_set = image;
  std::vector<uint32_t> counts(static_cast<size_t>(image.width) * image.height);
  if (set.step > 1) {
    for (size_t i = 0; i < counts.size(); ++i)
      for (int t = set.first; t < image.groups; t += set.step)
        counts[i] += group_size(image.counts[i], image.groups, t);
    of_set.counts = counts.data(), of_set.mean_count = 0;
  }
  const std::vector<float> relative = relative_counts(of_set);
  return relative.empty() ? Buffer<float>() : device.upload(std::span(relative));
}

void write_network_candidates(Device& device, const Groups& groups, const PartBuffers& part,
                              const Buffer<float>& relative_counts, const Image& clean, const Buffer<float>& results,
                              bool planted_bug) {
  const auto pixels = static_cast<size_t>(groups.pixels());
  const int width = groups.width, height = groups.height;
  const Buffer<float> image = device.upload(std::span(clean.data));
  const auto& [guide, other] = residual_input(device, part.noisy(), part.independent.variance_of_mean, relative_counts);
  device.launch(device.kernel("group_moments.cl", "scaled", with_bug({}, false)), list_of(3 * pixels), kOfList, image,
                1.0f, 3 * groups.pixels(), results);
  size_t first = 0;
  for (const ResidualOptions& options : kNetworkResiduals) {
    first += 3 * pixels;
    const int side = options.cell, columns = (width + side - 1) / side, rows = (height + side - 1) / side;
    const auto cells = static_cast<size_t>(columns) * rows;
    const auto features = device.make<float>(4 * cells), residuals = device.make<float>(4 * cells);
    device.launch(kernel(device, "residual_cells", side), image_of(columns, rows), kOfImage, image, groups.valid, guide,
                  other, width, height, features, residuals);
    device.launch(kernel(device, "add_residual", side, planted_bug), image_of(width, height), kOfImage, features,
                  residuals, groups.valid, image, width, height, options.window / 2 / side, options.bandwidth,
                  static_cast<int>(first), results);
  }
}

}  // namespace covary::gpu
