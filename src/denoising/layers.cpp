// SPDX-License-Identifier: Apache-2.0
#include "denoising/layers.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

#include "core/error.h"
#include "core/parallel.h"
#include "denoising/limited_groups.h"
#include "weighing/weighing.h"

namespace covary {
namespace {

/// The mean of the layer's groups, each scaled as that of the picture was limited if `limited` is given.
Image mean_of(const GroupedImage& layer, const GroupedImage& picture, const GroupedImage* limited,
              const std::vector<unsigned char>& valid) {
  std::vector<float> scaled;
  GroupedImage view = layer;
  if (limited) {
    scaled.assign(layer.data, layer.data + valid.size() * layer.groups * 3);
    view.data = scaled.data();
    parallel_for(scaled.size() / 3, 4096, [&](size_t group) {
      const float *before = picture.data + 3 * group, *after = limited->data + 3 * group;
      if (std::equal(before, before + 3, after)) return;
      const float scale = (after[0] + after[1] + after[2]) / (before[0] + before[1] + before[2]);
      for (size_t c = 0; c < 3; ++c) scaled[3 * group + c] *= scale;
    });
  }
  return mean_image(moments(view, valid, 0, 0.0f));
}

/// The weights of the candidates before one that consists of them; empty if there is none.
std::vector<Image> weights_of_made(const LayersInput& in) {
  std::vector<Image> weights;
  if (!in.shares || in.shares->count() == 0) return weights;
  for (size_t p = 0; p + 1 < in.weights.size(); ++p) {
    weights.push_back(share_of(*in.shares, static_cast<int>(p) + 1, in.weights.back()));
    std::transform(weights[p].data.begin(), weights[p].data.end(), in.weights[p].data.begin(), weights[p].data.begin(),
                   std::plus<>());
  }
  return weights;
}

}  // namespace

void add_up(const Image& image, std::span<Image* const> layers) {
  parallel_for(image.data.size(), 4096, [&](size_t i) {
    double sum = 0, size = 0;
    for (const Image* layer : layers) sum += layer->data[i], size += std::abs(layer->data[i]);
    const double missing = image.data[i] - sum, n = static_cast<double>(layers.size());
    for (Image* layer : layers) {
      const double part = size > 0 ? std::abs(layer->data[i]) / size : 1 / n;
      layer->data[i] = static_cast<float>(layer->data[i] + missing * part);
    }
  });
}

void add_up(const Image& image, std::span<const Layer> layers, std::span<Image> images) {
  std::map<int, std::vector<Image*>> sums;
  for (size_t k = 0; k < images.size(); ++k)
    if (layers[k].sum != Layer::kNoSum) sums[layers[k].sum].push_back(&images[k]);
  for (const auto& [number, parts] : sums) add_up(image, parts);
}

std::vector<Image> denoise_layers(const LayersInput& in) {
  const std::vector<unsigned char>& valid = *in.candidates.valid;
  const LimitedGroups limited(*in.independent, valid);
  std::vector<Image> result, without_fireflies;
  for (const Layer& layer : in.layers) {
    COVARY_CHECK(layer.image.groups == in.independent->groups, "layers have the groups of the picture");
    result.push_back(mean_of(layer.image, *in.independent, nullptr, valid));
    const GroupedImage* as_picture = layer.sum == Layer::kNoSum ? nullptr : &limited.view();
    without_fireflies.push_back(mean_of(layer.image, *in.independent, as_picture, valid));
  }
  const std::vector<Image> means = result;
  size_t p = 0;
  const std::vector<Image> shared = weights_of_made(in);
  const std::span<const Image> of_candidates = shared.empty() ? in.weights : std::span(shared);
  for (const CandidateMaker& maker : in.makers)
    if (maker.make_layers)
      for (const std::vector<Image>& candidate : maker.make_layers(in.candidates, without_fireflies)) {
        const std::vector<float>& weights = of_candidates[p++].data;
        for (size_t k = 0; k < result.size(); ++k)
          for (size_t i = 0; i < result[k].data.size(); ++i)
            if (valid[i / 3]) result[k].data[i] += weights[i / 3] * (candidate[k].data[i] - means[k].data[i]);
      }
  add_up(*in.image, in.layers, result);
  return result;
}

}  // namespace covary
