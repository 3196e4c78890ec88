// SPDX-License-Identifier: Apache-2.0
#include "combine/same_seed.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "combine/grey.h"

namespace covary {
namespace {

/// Squares of pixels in all groups together.
constexpr long kMaxSquares = 4000000;
/// Smallest D, over the square's brightness, that counts as a difference between neighbours: smooth parts and rounding
/// to 16 bits are below it.
constexpr float kMinDetail = 0.01f;
/// D of two groups is the same if it differs by no more than this, relative to it or, because of rounding to 16 bits,
/// to the square's brightness. Different seeds would need a million samples per pixel for that; sums in another order
/// differ by 1e-5.
constexpr float kSame = 1e-3f;
/// Squares with a difference between neighbours that are needed as evidence, and their part of those that are not flat:
/// noise is everywhere, edges are not.
constexpr long kMinSquares = 100;
constexpr double kMinPart = 0.25;
/// The fraction of them that may differ between groups of one seed: rounding sends a few paths elsewhere.
constexpr double kMaxDifferent = 0.05;

/// D of the square whose corner is (x, y), in group t, over its brightness. Sets `varied` if it is not exactly 0.
float detail(const GroupedImage& image, int x, int y, int t, bool& varied) {
  std::array<float, 4> g;
  for (int i = 0; i < 4; ++i) g[i] = grey(image.pixel(x + i % 2, y + i / 2) + 3 * t);
  const float d = g[0] - g[1] - g[2] + g[3];
  varied = std::isfinite(d) && d != 0;
  const float brightest = std::max({std::abs(g[0]), std::abs(g[1]), std::abs(g[2]), std::abs(g[3])});
  return varied && std::abs(d) > kMinDetail * brightest ? d / brightest : 0;
}

/// How the details of two groups compare.
struct Likeness {
  long squares = 0, differ = 0;
  bool identical = true;
  bool is_same(long varied) const {
    return squares >= kMinSquares && static_cast<double>(squares) >= kMinPart * static_cast<double>(varied) &&
           static_cast<double>(differ) <= kMaxDifferent * static_cast<double>(squares);
  }
};

Likeness compare(const std::vector<float>& a, const std::vector<float>& b) {
  Likeness likeness;
  for (size_t i = 0; i < a.size(); ++i) {
    const float size = std::max(std::abs(a[i]), std::abs(b[i])), difference = std::abs(a[i] - b[i]);
    likeness.squares += size > 0;
    likeness.differ += difference > kSame * std::max(size, 1.0f);
    likeness.identical &= difference == 0;
  }
  return likeness;
}

}  // namespace

SameSeedChecks::SameSeedChecks(int width, int height, int groups)
    : step_(static_cast<int>(std::max(1L, long{width} * height * groups / kMaxSquares))), groups_(groups) {}

void SameSeedChecks::add_rows(const GroupedImage& image) {
  for (int y = 0; y < image.height; ++y, ++next_row_) {
    if (next_row_ % step_ != 0 || y + 1 == image.height) continue;
    for (size_t t = 0; t < groups_.size(); ++t) {
      Group& group = groups_[t];
      for (int x = 0; x + 1 < image.width; ++x) {
        bool varied = false;
        group.details.push_back(detail(image, x, y, static_cast<int>(t), varied));
        group.varied += varied;
        const float value = grey(image.pixel(x, y) + 3 * t);
        if (std::isfinite(value)) group.sum += value;
      }
    }
  }
}

void SameSeedChecks::report(const ImageNames& names, std::vector<Finding>& findings) const {
  // Groups of one seed have nearly the same sum: with the groups in order of it, they are neighbours.
  std::vector<size_t> order(groups_.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](size_t a, size_t b) { return groups_[a].sum < groups_[b].sum; });
  for (size_t i = 1; i < order.size(); ++i) {
    const auto [a, b] = std::minmax(order[i - 1], order[i]);
    const Likeness likeness = compare(groups_[a].details, groups_[b].details);
    if (!likeness.is_same(std::max(groups_[a].varied, groups_[b].varied))) continue;
    const char* how = likeness.identical ? "are identical" : "have the same noise";
    findings.push_back(
        {Finding::Severity::kError,
         fmt::format("{}: {} and {} {}: the same seed was rendered twice, or there is no noise to "
                     "remove; give every render its own seed ({})",
                     names.image, names.render(a), names.render(b), how, names.how_to(RenderSetting::kSeed))});
    return;
  }
}

}  // namespace covary
