// SPDX-License-Identifier: Apache-2.0
#include "lab/overrides.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "lab/plan.h"

namespace covary::lab {
namespace {

/// Keeps only the named entries; every name must exist.
template <typename Entry>
void keep(const char* what, const std::vector<std::string>& names, std::vector<Entry>& entries) {
  std::vector<std::string> known;
  for (const Entry& entry : entries) known.push_back(entry.name);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error(ErrorCode::kUsage, fmt::format("the suite has no {} '{}'{}; it has '{}'", what, name,
                                                 did_you_mean(name, known), fmt::join(known, "', '")));
  std::erase_if(entries, [&](const Entry& e) { return std::find(names.begin(), names.end(), e.name) == names.end(); });
}

/// The centre of a crop, with at most kQuickCropPixels; anything else unchanged.
std::string quick_crop(const std::string& crop) {
  const std::vector<int> size = whole_numbers(crop, 'x'), window = whole_numbers(crop, ',');
  const bool in_the_middle = size.size() == 2;
  if (!in_the_middle && window.size() != 4) return crop;
  const int width = in_the_middle ? size[0] : window[2], height = in_the_middle ? size[1] : window[3];
  const double pixels = static_cast<double>(width) * height;
  if (pixels <= static_cast<double>(kQuickCropPixels)) return crop;
  const double factor = std::sqrt(static_cast<double>(kQuickCropPixels) / pixels);
  const int w = std::max(1, static_cast<int>(std::lround(factor * width))),
            h = std::max(1, static_cast<int>(std::lround(factor * height)));
  if (in_the_middle) return fmt::format("{}x{}", w, h);
  return fmt::format("{},{},{},{}", window[0] + (width - w) / 2, window[1] + (height - h) / 2, w, h);
}

void make_quick(Suite& suite) {
  constexpr size_t kSeeds = 3;
  constexpr uint32_t kSpp = 192, kReferenceSpp = 1024;
  if (suite.seeds.size() > kSeeds) suite.seeds.resize(kSeeds);
  std::erase_if(suite.budgets, [&](const Budget& b) { return b.spp > kSpp; });
  if (suite.budgets.empty()) suite.budgets.push_back({kSpp, 0});
  suite.reference.spp = std::min(suite.reference.spp, kReferenceSpp);
  for (SceneEntry& scene : suite.scenes) {
    if (scene.reference) scene.reference->spp = std::min(scene.reference->spp, kReferenceSpp);
    scene.crop = quick_crop(scene.crop);
  }
}

/// Checks that need no scene sizes.
void check_sizes(const Overrides& o) {
  if (!o.resolution.empty() && whole_numbers(o.resolution, 'x').size() != 2)
    throw Error(ErrorCode::kUsage, fmt::format("`resolution` '{}': expected WIDTHxHEIGHT", o.resolution));
  if (!o.crop.empty() && whole_numbers(o.crop, 'x').size() != 2 && whole_numbers(o.crop, ',').size() != 4)
    throw Error(ErrorCode::kUsage,
                fmt::format("`crop` '{}': expected X,Y,WIDTH,HEIGHT, or a centred WIDTHxHEIGHT", o.crop));
}

}  // namespace

void apply(const Overrides& o, Suite& suite) {
  check_sizes(o);
  if (o.quick) make_quick(suite);
  if (!o.baseline.empty()) suite.baseline = o.baseline;
  if (!o.scenes.empty()) keep("scene", o.scenes, suite.scenes);
  if (!o.methods.empty()) {
    std::vector<std::string> methods = o.methods;
    methods.push_back(suite.baseline);
    keep("method", methods, suite.methods);
  }
  if (!o.seeds.empty()) suite.seeds = o.seeds;
  if (!o.budgets.empty()) suite.budgets = o.budgets;
  if (suite.show && std::find(suite.budgets.begin(), suite.budgets.end(), *suite.show) == suite.budgets.end())
    suite.show.reset();
  for (SceneEntry& scene : suite.scenes) {
    if (!o.crop.empty()) scene.crop = o.crop;
    if (!o.resolution.empty()) scene.resolution = o.resolution;
    if (o.reference_spp || !o.reference_files.empty()) scene.reference.reset();
  }
  if (o.reference_spp) suite.reference = {*o.reference_spp, {}};
  if (!o.reference_files.empty()) suite.reference = {0, o.reference_files};
  // Drops published values of methods that are left out.
  for (auto* table : {&suite.published_relmse, &suite.published_ratio})
    for (auto& [scene, methods] : *table)
      std::erase_if(methods, [&](const auto& entry) { return !suite.method(entry.first); });
}

}  // namespace covary::lab
