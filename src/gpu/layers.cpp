// SPDX-License-Identifier: Apache-2.0
#include "gpu/layers.h"

#include <span>

#include "core/error.h"
#include "filters/mixture_weights.h"
#include "gpu/launch.h"

namespace covary::gpu {

LayerBuffers upload_layer(Device& device, const GroupedImage& layer, const Groups& picture, const Limits* limits,
                          bool planted_bug) {
  COVARY_CHECK(layer.groups == picture.groups, "layers have the groups of the picture");
  const auto pixels = static_cast<size_t>(picture.pixels());
  const Buffer<float> data = samples_on(device, layer);
  LayerBuffers result{device.make<float>(3 * pixels), device.make<float>(3 * pixels)};
  const Buffer<float>& not_read = data;
  device.launch(device.kernel("layers.cl", "layer_means", with_bug({}, planted_bug)), list_of(pixels), kOfList, data,
                picture.data, picture.counts, int{picture.has_counts}, picture.valid,
                limits ? limits->of_even : not_read, limits ? limits->of_odd : not_read, int{limits != nullptr},
                layer.groups, picture.pixels(), result.mean, result.noisy);
  return result;
}

double bytes_of_layer(int groups) { return 12.0 * groups + 12 * (kMaxCandidates + 7); }

}  // namespace covary::gpu
