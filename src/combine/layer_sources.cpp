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

bool has_size_of(const GroupedSource& layer, const GroupedImage& picture) {
  return layer.width == picture.width && layer.groups == picture.groups;
}

/// The image with the means of other groups in place of values that are not finite.
std::vector<float> without_bad_values(const GroupedImage& image) {
  std::vector<float> values(image.data, image.pixel(0, image.height));
  const size_t of_pixel = 3 * static_cast<size_t>(image.groups);
  for (size_t pixel = 0; pixel < values.size(); pixel += of_pixel)
    for (size_t c = 0; c < 3; ++c) {
      double sum = 0;
      int n = 0;
      for (size_t i = c; i < of_pixel; i += 3)
        if (std::isfinite(values[pixel + i])) sum += values[pixel + i], ++n;
      const float mean = n ? static_cast<float>(sum / n) : 0;
      for (size_t i = c; i < of_pixel; i += 3)
        if (!std::isfinite(values[pixel + i])) values[pixel + i] = mean;
    }
  return values;
}

}  // namespace

void LayerChecks::add_rows(int first, const GroupedImage& picture) {
  for (size_t l = 0; l < sources_.size(); ++l) {
    if (!has_size_of(sources_[l].groups, picture)) continue;  // WholeLayers refuses it
    const GroupedImage rows = sources_[l].groups.rows(first, picture.height);
    for (int y = 0; y < rows.height; ++y)
      for (int x = 0; x < rows.width; ++x) {
        const float *layer = rows.pixel(x, y), *all = picture.pixel(x, y);
        for (int i = 0; i < 3 * rows.groups; ++i) {
          if (std::isfinite(layer[i]) || !std::isfinite(all[i])) continue;
          BadValues& bad = bad_[l];
          if (bad.pixels++ == 0) bad.x = x, bad.y = first + y, bad.group = i / 3;
          break;
        }
      }
  }
}

void LayerChecks::report(const ImageNames& picture, std::vector<Finding>& findings) const {
  for (size_t l = 0; l < sources_.size(); ++l) {
    const BadValues& bad = bad_[l];
    if (bad.pixels)
      findings.push_back({Finding::Severity::kWarning,
                          fmt::format("the layer '{}': {} of {} pixels hold values that are not finite, the first at "
                                      "({}, {}) in {}; these values are left out; find the cause in the renderer",
                                      sources_[l].name, bad.pixels,
                                      static_cast<long>(sources_[l].groups.width) * sources_[l].groups.height, bad.x,
                                      bad.y, picture.render(static_cast<size_t>(bad.group)))});
  }
}

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
    if (!std::all_of(layer.image.data, layer.image.data + n, [](float value) { return std::isfinite(value); }))
      layer.image.data = mended_.emplace_back(without_bad_values(layer.image)).data();
    if (!source.sum) continue;
    const auto is_it = [&](const auto& rest) { return rest.first == *source.sum; };
    auto rest = std::find_if(rests.begin(), rests.end(), is_it);
    if (rest == rests.end())
      rest = rests.insert(rests.end(), {*source.sum, &rests_.emplace_back(picture.data, picture.data + n)});
    layer.sum = static_cast<int>(rest - rests.begin());
    for (size_t i = 0; i < n; ++i) (*rest->second)[i] -= layer.image.data[i];
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
