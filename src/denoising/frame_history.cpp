// SPDX-License-Identifier: Apache-2.0
#include "denoising/frame_history.h"

#include <algorithm>
#include <array>
#include <optional>

namespace covary {
namespace {

/// The mixture of independent samples whose halves have these means.
Mixture mixture_of_halves(const std::array<Image, 2>& halves, const std::vector<CandidateMaker>& makers,
                          const PartsWeighting& chosen) {
  GroupedImage groups{halves[0].width, halves[0].height, 2};
  std::vector<float> data;
  data.reserve(2 * halves[0].data.size());
  for (size_t i = 0; i < halves[0].data.size(); i += 3)
    for (const Image& half : halves) data.insert(data.end(), &half.data[i], &half.data[i] + 3);
  groups.data = data.data();
  return mix_parts(parts_of_mean(groups), makers, chosen).mixture;
}

}  // namespace

void use_history(const MixingHistory& use, const DenoisingParts& parts, const std::vector<CandidateMaker>& makers,
                 const PartsWeighting& chosen, const Image& frame_error, MixedParts& mixed,
                 std::vector<Image>& kept_samples) {
  const Image& guide = guide_of(mixed.whole);
  HistoryInput input{
      {&parts.halves[0].independent, &parts.halves[1].independent}, &frame_error, &guide, &parts.valid, {}, nullptr};
  const Image common_counts = use.before ? counts_of(*use.before, guide) : Image();
  input.common_counts = &common_counts;
  for (const int half : {0, 1})
    if (parts.is_mean) input.counts[half] = &mixed.counts[half];
  std::array<Image, 2> halves = {parts.halves[0].image.estimate, parts.halves[1].image.estimate};
  std::optional<Mixture> accumulated;
  const bool uses_samples = parts.is_mean && has_network(makers);
  if (use.before && uses_samples && !use.before->samples[0].data.empty()) {
    Image mean = parts.whole.image.estimate;
    add_samples(*use.before, input, mean, halves);
    accumulated = mixture_of_halves(halves, makers, chosen);
  }
  if (use.before) add_history(*use.before, input, accumulated ? &*accumulated : nullptr, mixed.mixture);
  if (!use.keep_samples) return;
  kept_samples.assign(kKeptSamples.size(), Image());
  if (uses_samples) std::move(halves.begin(), halves.end(), kept_samples.begin());
}

}  // namespace covary
