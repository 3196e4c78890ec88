// SPDX-License-Identifier: Apache-2.0
#include "gpu/dependent_filters.h"

#include <fmt/format.h>

#include <array>
#include <vector>

#include "gpu/denoising_parts.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

using device::Buffer, device::Device;

device::Kernel kernel(Device& device, const char* name, Falloff falloff, Norm norm, bool planted_bug) {
  return device.kernel("dependent_tests.cl", name,
                       with_bug({fmt::format("FALLOFF={}", static_cast<int>(falloff)),
                                 fmt::format("EUCLIDEAN={}", static_cast<int>(norm == Norm::kEuclidean))},
                                planted_bug));
}

struct InputBuffers {
  Buffer<float> dependent, independent, variance, count;
  InputBuffers(Device& device, const FilterInput& input)
      : dependent(upload(device, input.dependent)),
        independent(upload(device, input.independent)),
        variance(upload(device, input.variance)),
        count(upload(device, input.count)) {}
};

/// What the kernels write.
struct ResultBuffers {
  Buffer<float> colour, values;
  ResultBuffers(Device& device, const FilterInput& input)
      : colour(device.make<float>(3 * static_cast<size_t>(input.width()) * input.height())),
        values(device.make<float>(4 * static_cast<size_t>(input.width()) * input.height())) {}

  FilteredImage download(Device& device, const FilterInput& input) const {
    FilteredImage result(input.width(), input.height());
    device.read(colour, result.colour.data);
    const std::vector<float> all = device.download(values);
    const std::array<Image*, 4> images = {&result.region, &result.centre_weight, &result.bound,
                                          &result.effective_samples};
    for (size_t i = 0; i < all.size(); ++i) images[i % 4]->data[i / 4] = all[i];
    return result;
  }
};

}  // namespace

FilteredImage region_filter(Device& device, const FilterInput& input, const RegionOptions& options, bool planted_bug) {
  const InputBuffers in(device, input);
  const ResultBuffers result(device, input);
  device.launch(kernel(device, "region_filter", options.falloff, input.norm, planted_bug),
                image_of(input.width(), input.height()), kOfImage, in.dependent, in.independent, in.variance, in.count,
                input.width(), input.height(), options.max_region, options.min_centre_drop, result.colour,
                result.values);
  return result.download(device, input);
}

FilteredImage bound_filter(Device& device, const FilterInput& input, int window, const Planes* difference_scale,
                           bool planted_bug) {
  const InputBuffers in(device, input);
  const ResultBuffers result(device, input);
  const Buffer<float> scale = difference_scale ? upload(device, *difference_scale) : device.make<float>(1);
  device.launch(kernel(device, "bound_filter", Falloff::kPyramid, input.norm, planted_bug),
                image_of(input.width(), input.height()), kOfImage, in.dependent, in.independent, in.variance, in.count,
                scale, int{difference_scale != nullptr}, input.width(), input.height(), window / 2, result.colour,
                result.values);
  return result.download(device, input);
}

EstimatorResult dependent_tests(Device& device, const GroupedImage& crn, const GroupedImage& independent,
                                const DependentTestsOptions& options) {
  DependentFilters filters;
  filters.region = [&](const FilterInput& input, const RegionOptions& regions) {
    return gpu::region_filter(device, input, regions);
  };
  filters.bound = [&](const FilterInput& input, int window, const Planes* difference_scale) {
    return gpu::bound_filter(device, input, window, difference_scale);
  };
  return covary::dependent_tests(crn, independent, options, nullptr, filters);
}

}  // namespace covary::gpu
