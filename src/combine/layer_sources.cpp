// SPDX-License-Identifier: Apache-2.0
#include "combine/layer_sources.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"

namespace covary {
namespace {

constexpr double kNothing = 1e-3;  // relative to the picture

[[noreturn]] void fail(const std::string& name, const std::string& text) {
  throw Error(ErrorCode::kInput, fmt::format("the layer '{}' {}", name, text));
}

void check(const LayerSource& source, const GroupedImage& picture) {
  const GroupedSource& g = source.groups;
  if (g.width != picture.width || g.height != picture.height || g.groups != picture.groups)
    fail(source.name, fmt::format("has {} x {} pixels in {} groups, the image {} x {} in {}", g.width, g.height,
                                  g.groups, picture.width, picture.height, picture.groups));
}

}  // namespace

WholeLayers::WholeLayers(const GroupedImage& picture, std::span<const LayerSource> sources) {
  const size_t n = static_cast<size_t>(picture.width) * picture.height * picture.groups * 3;
  std::vector<std::pair<std::string, std::vector<float>*>> rests;  // of each sum
  for (const LayerSource& source : sources) {
    if (source.name == kRest ||
        std::any_of(layers_.begin(), layers_.end(), [&](const Layer& other) { return other.name == source.name; }))
      fail(source.name, "appears twice");
    check(source, picture);
    Layer& layer = layers_.emplace_back(Layer{source.name, source.groups.all()});
    layer.image.counts = picture.counts, layer.image.mean_count = picture.mean_count;
    layer.sum = Layer::kNoSum;
    if (!source.sum) continue;
    const auto is_it = [&](const auto& rest) { return rest.first == *source.sum; };
    auto rest = std::find_if(rests.begin(), rests.end(), is_it);
    if (rest == rests.end())
      rest = rests.insert(rests.end(), {*source.sum, &rests_.emplace_back(picture.data, picture.data + n)});
    layer.sum = static_cast<int>(rest - rests.begin());
    for (size_t i = 0; i < n; ++i) {
      if (!std::isfinite(layer.image.data[i]) && std::isfinite(picture.data[i]))
        fail(source.name, "has values that are not finite");
      (*rest->second)[i] -= layer.image.data[i];
    }
  }
  for (size_t r = 0; r < rests.size(); ++r) {
    const auto& [sum, values] = rests[r];
    double left = 0, all = 0;
    for (size_t i = 0; i < n; ++i)
      if (std::isfinite((*values)[i])) left += std::abs((*values)[i]), all += std::abs(picture.data[i]);
    if (left <= kNothing * all) continue;
    GroupedImage rest = picture;
    rest.data = values->data();
    layers_.push_back({sum.empty() ? kRest : kRest + ("_" + sum), rest, static_cast<int>(r)});
  }
}

}  // namespace covary
