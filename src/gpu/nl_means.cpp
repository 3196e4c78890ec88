// SPDX-License-Identifier: Apache-2.0
#include "gpu/nl_means.h"

#include <fmt/format.h>

#include "core/error.h"
#include "gpu/launch.h"

namespace covary::gpu {
namespace {

/// Pixels that a work group filters, along both axes, with its items (kernels/nl_means.cl).
constexpr uint32_t kInner = 30;
constexpr device::Range kGroup{32, 8};

uint32_t groups_for(int size) { return (static_cast<uint32_t>(size) + kInner - 1) / kInner; }

}  // namespace

void nl_means(device::Device& device, const NlMeansInput& input, std::span<const Place> results) {
  const size_t n_features = input.features.size(), n_tasks = input.bandwidths.size();
  COVARY_CHECK(n_features <= 2 && (n_tasks == 1 || n_tasks == 2) && results.size() == n_tasks,
               "at most two features, one or two bandwidths");
  COVARY_CHECK(results[0].buffer == results[n_tasks - 1].buffer, "results are in one buffer");
  const device::Kernel kernel =
      device.kernel("nl_means.cl", "nl_means",
                    with_bug({fmt::format("GUIDES={}", n_features), fmt::format("TASKS={}", n_tasks),
                              fmt::format("SOURCE={}", int{input.source != nullptr})},
                             input.planted_bug));
  const FeatureImage none{input.image, 1};  // not read
  const FeatureImage& first = n_features > 0 ? input.features[0] : none;
  const FeatureImage& second = n_features > 1 ? input.features[1] : none;
  const device::Range items{groups_for(input.width) * kGroup.x, groups_for(input.height) * kGroup.y};
  device.launch(kernel, items, kGroup, *input.image, input.source ? *input.source : *input.image, *input.std_error,
                *input.valid, *first.image, first.unit, *second.image, second.unit, input.width, input.height,
                input.bandwidths[0], input.bandwidths.back(), *results[0].buffer, static_cast<int>(results[0].first),
                static_cast<int>(results[n_tasks - 1].first));
}

}  // namespace covary::gpu
