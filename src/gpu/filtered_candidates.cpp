// SPDX-License-Identifier: Apache-2.0
#include "gpu/filtered_candidates.h"

#include "gpu/launch.h"

namespace covary::gpu {
namespace {

Buffer<float> uploaded(Device& device, const Image* image) {
  return image ? device.upload(std::span(image->data)) : Buffer<float>();
}

device::Kernel modulation(Device& device, const char* name) {
  return device.kernel("modulation.cl", name, with_bug({}, false));
}

Buffer<float> demodulated(Device& device, const Buffer<float>& image, const Buffer<float>& albedo) {
  auto result = device.make<float>(image.size());
  device.launch(modulation(device, "demodulate"), list_of(image.size()), kOfList, image, albedo,
                static_cast<int>(image.size()), result);
  return result;
}

const Buffer<float>* or_null(const Buffer<float>& buffer) { return buffer ? &buffer : nullptr; }

}  // namespace

FeatureBuffers::FeatureBuffers(Device& device, const Features& features, FilterKinds kinds)
    : albedo_(uploaded(device, features.albedo)),
      normal_(uploaded(device, features.normal)),
      albedo_behind_(uploaded(device, features.denoising_albedo)),
      normal_behind_(uploaded(device, features.denoising_normal)) {
  if (features.albedo) of_light_ = device.upload(std::span<const float>(feature_of_light(features).data));
  const RegressionFeatures regression = regression_features(features, kinds);
  nl_means_ = regression.nl_means;
  if (regression.features.empty()) return;
  const Buffer<float> position = uploaded(device, regression.position);
  std::vector<Buffer<float>> images;
  std::vector<const Buffer<float>*> pointers;
  for (const Image* feature : regression.features) images.push_back(uploaded(device, feature));
  for (const Buffer<float>& image : images) pointers.push_back(&image);
  features_ = features_of(device, pointers, or_null(position));
}

SurfaceBuffers FeatureBuffers::surfaces() const {
  return {or_null(normal_), or_null(normal_behind_), or_null(albedo_), or_null(albedo_behind_)};
}

void filter(Device& device, const Groups& groups, const FeatureBuffers& features, CandidateBase base,
            const PartBuffers& part, bool is_half, const Place& results, const Buffer<float>* layer) {
  const size_t values = 3 * static_cast<size_t>(groups.pixels());
  size_t next = results.first + (features.features() ? values : 0);  // the regression is the first
  NlMeansInput input{groups.width, groups.height, &part.noisy(), &part.noisy_error(), &groups.valid};
  if (features.nl_means()) {
    if (features.albedo()) input.features.push_back({features.albedo(), kAlbedoUnit});
    if (features.normal()) input.features.push_back({features.normal(), kNormalUnit});
    input.bandwidths = {kSharpBandwidth, kSmoothBandwidth};
    const bool is_pair = base == CandidateBase::kPair;
    const size_t smooth = next + (is_pair ? 2 : 1) * values;
    input.source = layer;
    gpu::nl_means(device, input, {{Place{results.buffer, next}, Place{results.buffer, smooth}}});
    if (is_pair) {
      input.source = &part.independent.mean, input.bandwidths = {kSharpBandwidth};
      gpu::nl_means(device, input, {{Place{results.buffer, next + values}}});
    }
    next = smooth + values;
  }
  if (!features.albedo()) return;
  const Buffer<float> image = demodulated(device, part.noisy(), *features.albedo());
  const Buffer<float> error = demodulated(device, part.noisy_error(), *features.albedo());
  const auto clean = device.make<float>(values);
  const Buffer<float> source = layer ? demodulated(device, *layer, *features.albedo()) : Buffer<float>();
  input.image = &image, input.std_error = &error, input.source = or_null(source);
  input.features.clear();
  input.features.push_back({features.of_light(), kNormalUnit});
  input.bandwidths = {kSharpBandwidth};
  gpu::nl_means(device, input, {{Place{&clean}}});
  device.launch(modulation(device, "modulate"), list_of(values), kOfList, clean, *features.albedo(),
                static_cast<int>(values), static_cast<int>(next), *results.buffer);
  if (!features.features()) return;
  regressed(device,
            {.width = groups.width,
             .height = groups.height,
             .image = &part.noisy(),
             .std_error = &part.noisy_error(),
             .valid = &groups.valid,
             .features = features.features(),
             .other = {results.buffer, next},
             .coarse = is_half,
             .source = layer},
            *results.buffer);
}

}  // namespace covary::gpu
