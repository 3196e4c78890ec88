// SPDX-License-Identifier: Apache-2.0
#include "lab/overrides.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "core/error.h"
#include "core/known_names.h"
#include "lab/plan.h"

namespace covary::lab {
namespace {

/// The names that are meant: words that are no names, as names may hold commas, are names separated by commas.
std::vector<std::string> split_names(const std::vector<std::string>& words, const std::vector<std::string>& known) {
  std::vector<std::string> names;
  for (const std::string& word : words) {
    const bool is_name = std::find(known.begin(), known.end(), word) != known.end();
    for (size_t at = 0; at <= word.size();) {
      const size_t end = is_name ? word.size() : std::min(word.find(',', at), word.size());
      names.push_back(word.substr(at, end - at));
      at = end + 1;
    }
  }
  return names;
}

/// Keeps only the named entries; every name must exist.
template <typename Entry>
void keep(const char* what, const std::vector<std::string>& words, std::vector<Entry>& entries) {
  std::vector<std::string> known;
  for (const Entry& entry : entries) known.push_back(entry.name);
  const std::vector<std::string> names = split_names(words, known);
  for (const std::string& name : names)
    if (std::find(known.begin(), known.end(), name) == known.end())
      throw Error(ErrorCode::kUsage,
                  fmt::format("the suite has no {} '{}'", what, name) +
                      hint_and_list(name, known, fmt::format("it has '{}'", fmt::join(known, "', '"))));
  std::erase_if(entries, [&](const Entry& e) { return std::find(names.begin(), names.end(), e.name) == names.end(); });
}

/// The text of a size, smaller by `factor`.
std::pair<int, int> scaled(int width, int height, double factor) {
  return {std::max(1, static_cast<int>(std::lround(factor * width))),
          std::max(1, static_cast<int>(std::lround(factor * height)))};
}

/// What lengths of an area are to be multiplied with, so that it has at most `most` pixels.
double factor_for(int width, int height, int64_t most) {
  const double pixels = static_cast<double>(width) * height;
  return pixels <= static_cast<double>(most) ? 1 : std::sqrt(static_cast<double>(most) / pixels);
}

/// "WIDTHxHEIGHT" of at most `most` pixels; anything else unchanged.
std::string quick_size(const std::string& text, int64_t most) {
  const std::vector<int> size = whole_numbers(text, 'x');
  if (size.size() != 2) return text;
  const auto [w, h] = scaled(size[0], size[1], factor_for(size[0], size[1], most));
  return fmt::format("{}x{}", w, h);
}

/// The centre of a crop, with at most `most` pixels; anything else unchanged.
std::string quick_crop(const std::string& crop, int64_t most) {
  const std::vector<int> window = whole_numbers(crop, ',');
  if (window.size() != 4) return quick_size(crop, most);
  const auto [w, h] = scaled(window[2], window[3], factor_for(window[2], window[3], most));
  return fmt::format("{},{},{},{}", window[0] + (window[2] - w) / 2, window[1] + (window[3] - h) / 2, w, h);
}

/// `chosen`: the scenes were chosen by their names, and all stay.
void make_quick(const QuickLimits& limits, bool chosen, Suite& suite) {
  if (suite.seeds.size() > limits.seeds) suite.seeds.resize(limits.seeds);
  if (!chosen && limits.scenes > 0 && suite.scenes.size() > limits.scenes) suite.scenes.resize(limits.scenes);
  std::erase_if(suite.budgets, [&](const Budget& b) { return b.spp > limits.spp; });
  if (suite.budgets.empty()) suite.budgets.push_back({limits.spp, 0});
  if (limits.seconds > 0)
    for (Budget& budget : suite.budgets) budget.seconds = std::min(budget.seconds, limits.seconds);
  suite.reference.spp = std::min(suite.reference.spp, limits.reference_spp);
  for (SceneEntry& scene : suite.scenes) {
    if (scene.reference) scene.reference->spp = std::min(scene.reference->spp, limits.reference_spp);
    scene.crop = quick_crop(scene.crop, limits.crop_pixels);
    if (limits.sized_pixels > 0) scene.resolution = quick_size(scene.resolution, limits.sized_pixels);
  }
}

/// Only the named methods, and the baseline.
void keep_methods(std::vector<std::string> names, Suite& suite) {
  if (names.empty()) return;
  names.push_back(suite.baseline);
  keep("method", names, suite.methods);
}

/// Checks that need no scene sizes.
void check_sizes(const Overrides& o) {
  for (const auto& [name, text] : {std::pair{"resolution", o.resolution}, {"size", o.size}})
    if (!text.empty() && whole_numbers(text, 'x').size() != 2)
      throw Error(ErrorCode::kUsage, fmt::format("`{}` '{}': expected WIDTHxHEIGHT", name, text));
  if (!o.size.empty() && (!o.resolution.empty() || !o.crop.empty()))
    throw Error(ErrorCode::kUsage, "`size` renders whole frames; give it without `crop` and `resolution`");
  if (!o.crop.empty() && whole_numbers(o.crop, 'x').size() != 2 && whole_numbers(o.crop, ',').size() != 4)
    throw Error(ErrorCode::kUsage,
                fmt::format("`crop` '{}': expected X,Y,WIDTH,HEIGHT, or a centred WIDTHxHEIGHT", o.crop));
}

}  // namespace

int64_t max_pixels(const Overrides& o) {
  const std::vector<int> size = whole_numbers(o.size, 'x');
  if (size.size() == 2) return static_cast<int64_t>(size[0]) * size[1];
  return o.quick ? o.quick->pixels : 0;
}

void apply(const Overrides& o, Suite& suite) {
  check_sizes(o);
  if (!o.scenes.empty()) keep("scene", o.scenes, suite.scenes);
  if (o.quick) make_quick(*o.quick, !o.scenes.empty(), suite);
  if (!o.baseline.empty()) suite.baseline = o.baseline;
  keep_methods(o.methods.empty() && o.quick ? o.quick->methods : o.methods, suite);
  if (!o.seeds.empty()) suite.seeds = o.seeds;
  if (!o.budgets.empty()) suite.budgets = o.budgets;
  if (suite.show && std::find(suite.budgets.begin(), suite.budgets.end(), *suite.show) == suite.budgets.end())
    suite.show.reset();
  for (SceneEntry& scene : suite.scenes) {
    if (!o.size.empty()) scene.crop.clear(), scene.resolution.clear();
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
